"""Two runs of a simulated vehicle: what the one holds that the other does not, on runs whose cause is known."""

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from soak import rows_rest_in_soak

from bench.fossen.__main__ import command, said
from bench.fossen.answer import answer
from bench.fossen.candidates import ALONE, BIAS, CURRENT
from bench.fossen.evidence import judged, nats
from bench.fossen.fit import Pair, weigh
from bench.fossen.runs import load_run
from bridge.errors import LogError
from identify.diagnose.verdict import probability

SHARED = Path(__file__).resolve().parents[2].parent / "shared"
RUNS = SHARED / "data" / "fossen_simulator"
ANSWERS = Path(__file__).resolve().parents[1] / "data" / "sealed_answers"
COUNT, STEP_S = 1500, 0.1


def test_a_command_without_a_folder_or_with_one_that_can_t_be_says_so(tmp_path, caplog):
    with pytest.raises(SystemExit) as left:
        command([str(tmp_path)])
    assert left.value.code == 2
    taken = tmp_path / "taken"
    taken.write_text("", encoding="utf-8")
    assert command([str(tmp_path), str(taken)]) == 1
    assert f"{taken}: is no folder to write into" in caplog.text


@cache
def otter(seed, north=0.0, east=0.0, gain=1.0):
    """A surge, sway and yaw of its own, with two propellers, in a current."""
    rng = np.random.default_rng(seed)
    push = np.repeat(rng.uniform(-60.0, 90.0, (COUNT // 50, 2)), 50, axis=0)
    nu, psi, fine = np.zeros(3), 0.0, 20
    run = {name: np.zeros(COUNT) for name in ("x", "y", "z", "phi", "theta", *"wpq")}
    run |= {"t": np.arange(COUNT) * STEP_S, "act0": push[:, 0], "act1": push[:, 1]}
    rows = []
    for left, right in push:
        rows.append((*nu, psi))
        for _ in range(fine):
            u_water = np.cos(psi) * north + np.sin(psi) * east
            v_water = np.cos(psi) * east - np.sin(psi) * north
            u, v, r = nu[0] - u_water, nu[1] - v_water, nu[2]
            thrust = [gain * 1e-4 * one * abs(one) for one in (left, right)]
            rates = (
                sum(thrust) - 0.3 * u - 0.5 * u * abs(u) + v * r + r * v_water,
                -0.6 * v - 0.4 * u * r - r * u_water,
                0.5 * (thrust[0] - thrust[1]) - 0.8 * r - 0.1 * u * v,
            )
            nu, psi = nu + STEP_S / fine * np.array(rates), psi + STEP_S / fine * r
    run["u"], run["v"], run["r"], run["psi"] = np.array(rows).T
    return run


def test_a_current_in_one_of_two_runs_is_told_by_its_two_components():
    pair = Pair("otter", otter(1), otter(1, north=0.2, east=-0.1))
    found, nothing, biased = (weigh(pair, one) for one in (CURRENT, ALONE, BIAS))
    assert found.values == pytest.approx([0.2, -0.1], abs=0.003)
    assert np.mean(found.left) < 0.3 * min(np.mean(nothing.left), np.mean(biased.left))


def test_two_runs_of_the_same_still_water_hold_no_current():
    found = weigh(Pair("otter", otter(1), otter(2)), CURRENT)
    assert found.values == pytest.approx([0.0, 0.0], abs=0.003)


@pytest.mark.soak
def test_of_two_runs_the_one_in_a_current_is_named_with_how_probable_that_is():
    found = judged("otter", {"a": otter(1), "b": otter(2, north=0.2, east=-0.1)})
    assert (found.verdict, found.run) == ("explained", "b")
    assert list(found.probabilities) == ["steady_current"]
    best_without = min(
        (one for one in found.weighed if "steady_current" not in one.candidate.causes),
        key=lambda one: one.mean_square,
    )
    ratio = best_without.mean_square / found.found.mean_square
    assert nats(found.found, best_without) == pytest.approx(1.5 * 8 * np.log(ratio))
    sure = probability(nats(found.found, best_without))
    assert 0.5 < found.probabilities["steady_current"] == pytest.approx(sure)
    told = answer(found)
    assert told["run"] == "b"
    assert told["effects"][0]["parameters"]["north"]["value"] == pytest.approx(0.2, abs=0.003)
    assert told["gap"]["force"] == {"surge": None, "sway": None, "yaw": None}
    assert min(told["gap"]["acceleration"].values()) > 0


def test_weaker_propellers_in_one_run_are_told_and_that_it_may_be_either_run():
    found = judged("otter", {"a": otter(1), "b": otter(2, gain=0.7)})
    assert (found.verdict, found.run) == ("explained", None)
    assert list(found.probabilities) == ["thrust_gain"]
    assert answer(found)["shrink"]["heldout"]["value"] > 0.9
    assert "one of the runs, which can't be told, holds" in said(found)


def test_two_runs_of_the_same_hold_nothing():
    found = judged("otter", {"a": otter(1), "b": otter(2)})
    assert (found.verdict, found.run, found.probabilities) == ("no_gap", None, {})
    told = answer(found)
    assert (told["effects"], told["shrink"]["heldout"]) == ([], None)


def test_a_run_without_the_actuators_states_is_refused(tmp_path):
    (tmp_path / "otter_a.csv").write_text("t,x\n0.0,1.0\n0.1,1.0\n")
    with pytest.raises(LogError, match="no column 'z'"):
        load_run(tmp_path, "otter", "a")


@pytest.mark.parametrize(
    ("vehicle", "run", "north", "east"),
    rows_rest_in_soak([("otter", "b", 0.26, 0.15), ("remus100", "a", 0.2, 0.346)]),
)
def test_the_answers_kept_are_those_that_the_runs_give(vehicle, run, north, east):
    if not RUNS.exists():
        pytest.skip("needs ../shared/data beside the checkout")
    other = {"a": "b", "b": "a"}[run]
    found = weigh(Pair(vehicle, load_run(RUNS, vehicle, other), load_run(RUNS, vehicle, run)), CURRENT)
    kept = json.loads((ANSWERS / f"{vehicle}.json").read_text())
    assert found.values == pytest.approx([north, east], abs=0.002)
    assert kept["run"] == run
    assert [one["name"] for one in kept["effects"]] == ["steady_current"]
    assert kept["effects"][0]["parameters"]["north"]["value"] == pytest.approx(found.values[0], abs=1e-4)
    left = {name: np.mean(np.square([*one.values()])) for name, one in kept["tried"].items()}
    without = min(one for name, one in left.items() if "current" not in name)
    margin = 1.5 * found.pieces * np.log(without / left["steady_current"])
    assert kept["effects"][0]["probability"] == pytest.approx(probability(margin), abs=1e-6)
