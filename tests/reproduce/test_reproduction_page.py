"""The reproduction's dives and page: every table and figure of the paper."""

import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sketches

from bench.reproduce import page
from bench.reproduce.comparisons import validation
from bench.reproduce.dives import TURN_RAD, carrying, identified, legs, without_inertia
from bench.reproduce.paper import PaperOptions, sized
from bench.reproduce.run import Reproduction, planned
from bench.reproduce.sections import campaign_section
from bridge import exit_codes
from bridge.errors import ParamRejected
from bridge.plain import plain
from bridge.simulator.direct import simulate_truth
from bridge.simulator.missions import rest, run, turn
from bridge.vehicle.coefficients import BY_NAME
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.legs import Mission
from bridge.vehicle.mode import Mode
from bridge.vehicle.parameters import bounds
from identify.dive import Dive, Signal
from identify.report.page import render_report
from tui import cli


def dive(file, configuration, mission, mode, coefficients=None, seed=100_001):
    """A dive with the signals of a recording; velocity with a little noise, the rest exact."""
    run = simulate_truth(file, configuration, mission, seed=seed, parameters=coefficients, mode=mode)
    rng = np.random.default_rng(seed)
    time_s, n = run.time_s, len(run.time_s)

    def of(value):
        return Signal(time_s, np.asarray(value, dtype=float).reshape(n, -1))

    reference = [
        (*a.reference.nu, *a.reference.nu_dot, a.reference.heading_rad, a.reference.depth_m)
        for a in run.actuations
    ]
    return Dive(
        mission.name,
        Path(f"{mission.name}.tlog"),
        "2" * 64,
        velocity=of(run.nu[:, :3] + 0.003 * rng.standard_normal((n, 3))),
        gyro=of(run.nu[:, 3:]),
        attitude=of(run.state[:, 3:7]),
        pwm=of(run.column("pwm_us")),
        tau_pid=of(run.column("tau_pid")),
        tau_ff=of(run.column("tau_ff")),
        tau_cmd=of(run.column("tau_cmd")),
        nu_ref=of(reference),
        ff_mode=of(np.full(n, float(mode))),
    )


TINY = PaperOptions(hidden=4, depth=1, epochs=40, batch=32, threads=1)


def campaign_legs(sways):
    """A minute and a half that moves every axis of the configuration."""
    mission = rest("start", 2.0)
    for speed in (0.4, 0.2):
        mission += run(f"ahead {speed}", speed, 0.0, 10.0 * speed) + rest("stop", 1.0)
        mission += run(f"aside {speed}", 0.0, speed, 8.0 * speed) if sways else []
    for angle in (1.5, -1.5):
        mission += turn(f"turn {angle}", angle, 0.2, "linear") + rest("rest", 2.0)
    return tuple(mission)


@pytest.fixture(scope="module")
def done():
    file = load_vehicle("ruvifist")
    campaigns = {}
    for name in ("survey", "hovering"):
        mission = Mission(name, campaign_legs(sways=name == "hovering"))
        recorded = dive(file, name, mission, Mode.OFF)
        campaigns[name] = identified(recorded, file, name, TINY, lambda _: None)
    flown = {
        trial.name: dive(
            file,
            trial.configuration,
            Mission(trial.name, tuple(legs(trial.shape))),
            trial.mode,
            trial.coefficients,
        )
        for trial in planned(file, campaigns)
    }
    return Reproduction(file, TINY, 100_001, campaigns, flown)


@pytest.fixture(scope="module")
def text(done):
    """The page, its figures put together but not rendered."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("identify.report.picture.inline", sketches.inline)
        return render_report(page.report(done))


BESIDE = r"https?://|<script|<img|url\((?!#)|<link|@import"


@pytest.mark.soak
def test_every_table_and_figure_of_the_paper_is_on_a_page_that_needs_nothing_beside_it(text):
    for number in (3, 4, 5):
        assert f"Table {number}" in text
    for number in (*range(6, 17), "17 (a)", "17 (b)"):
        assert re.search(rf"As Fig\. {re.escape(str(number))}[.:]", text), number
    for heading in ("Where the numbers do not fit", "Where they fit", "Left open: heave"):
        assert f"{heading}</h2>" in text
    assert not re.search(BESIDE, text)


@pytest.mark.soak
def test_the_paper_stands_beside_the_vehicle_that_is_made_of_it(text):
    def row(name):
        return re.search(rf"<tr><th scope=\"row\">{re.escape(name)}</th>(.*?)</tr>", text).group(1)

    assert re.findall(r">([^<]*)</td>", row("D_v, N/(m/s)"))[:2] == ["53.05", "53.05"]
    assert "not printed" in row("I_r, kg m²")


@pytest.mark.soak
@pytest.mark.parametrize("configuration", ["survey", "hovering"])
def test_training_tends_to_the_least_of_the_loss(done, configuration):
    campaign = done.campaigns[configuration]
    assert campaign.paper.values() == pytest.approx(dict(campaign.closed), rel=0.02)


@pytest.mark.soak
def test_a_training_that_was_cut_short_is_warned_of(done):
    campaign = done.campaigns["survey"]
    shape = done.file.vehicle.configurations["survey"]
    early = {"epochs": 1, "batch": 1000}
    begun = identified(campaign.dive, done.file, "survey", replace(TINY, **early), lambda _: None)
    assert "had not ended" in campaign_section(begun, shape).warning
    assert not campaign_section(campaign, shape).warning


@pytest.mark.soak
def test_inertia_in_the_feed_forward_shortens_the_lag_of_a_smooth_turn(done):
    runs = page.to_json(done)["left_open"]["turns"]
    without, with_it = (runs[f"smooth reference, {form}"] for form in ("no inertia", "inertia"))
    assert with_it["lag_s"] < 0.5 * without["lag_s"]
    assert with_it["error_deg"] < 0.5 * without["error_deg"]


@pytest.mark.soak
def test_what_the_delay_is_of_the_error_while_speeding_up_is_said(done, text):
    rows = {(r.figure, r.what): r for r in validation(done)}
    late = rows["Fig. 15", "error speeding up, delay out"]
    whole = rows["Fig. 15", "error speeding up"]
    assert late.by_paper < whole.by_paper
    said = text.replace("\N{NO-BREAK SPACE}", " ")
    assert f"from {whole.by_paper:.4f} to {late.by_paper:.4f} m/s with its values" in said
    assert f"from {whole.by_ours:.4f} to {late.by_ours:.4f} m/s with ours" in said


@pytest.mark.soak
def test_eq_16_lags_by_inertia_over_damping_on_a_linear_reference(done):
    truth = done.campaigns["survey"].truth
    row = next(r for r in validation(done) if r.what == "heading behind the ramp")
    assert row.paper == 1.0
    assert row.by_paper == pytest.approx(truth["I_r"] / truth["D_r"], abs=0.35)


@pytest.mark.soak
def test_the_json_is_plain_and_holds_every_validation_number(done):
    data = json.loads(json.dumps(plain(page.to_json(done)), allow_nan=False))
    assert {row["figure"] for row in data["validation"]} == {f"Fig. {n}" for n in range(10, 18) if n != 0}
    assert len(data["table_5"]["rows"]) == 8
    assert all(len(row["values"]) == len(data["table_5"]["columns"]) for row in data["table_5"]["rows"])
    assert data["campaigns"]["hovering"]["published"]["X_udot"]["value"] == 39.6
    misfits = len(data["does_not_fit"])
    assert f"On {misfits} points the paper's text and numbers do not fit" in page.verdict(done)


def test_the_network_is_small_unless_another_is_asked_for():
    small, large = sized(None), sized([1024, 5, 100])
    assert small.hidden < large.hidden == 1024
    assert (large.depth, large.epochs) == (5, 100)


@pytest.mark.soak
def test_the_command_writes_page_and_results_into_a_folder_of_its_own(done, tmp_path, monkeypatch, capsys):
    asked = []

    def quickly(_root, seed, _unix_s, network, tell):
        asked.append((seed, network.hidden))
        tell(1.0, "done")
        return replace(done, seed=seed)

    # All of its figures are put together for the tests above; these are rendered.
    brief = replace(page.report(done), sections=page.report(done).sections[:1])
    monkeypatch.setattr(page, "report", lambda _: brief)
    monkeypatch.setattr("tui.commands.reproduce.reproduce", quickly)
    line = ["reproduce", "--seed", "7", "--network", "8", "1", "3", "--out", str(tmp_path), "--json", "-"]
    assert cli.main(line) == exit_codes.DONE
    shown = capsys.readouterr()
    data = json.loads(shown.out)
    assert asked == [(7, 8)]
    assert data["seed"] == 7
    folder = Path(data["folder"])
    assert folder.parent == tmp_path
    html = (folder / "reproduction.html").read_text(encoding="utf-8")
    assert html.startswith("<!DOCTYPE html>")
    assert not re.search(BESIDE, html)
    assert json.loads((folder / "result.json").read_text(encoding="utf-8")) == data
    assert "Fig. 14" in shown.err


def test_a_place_that_can_not_be_written_to_is_told_before_any_dive(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("tui.commands.reproduce.reproduce", lambda *_: pytest.fail("dived all the same"))
    line = ["reproduce", "--out", str(tmp_path), "--json", str(tmp_path / "nowhere" / "r.json")]
    assert cli.main(line) == exit_codes.BAD_INPUT
    assert "there is no folder" in capsys.readouterr().err


FILE = load_vehicle("ruvifist")
VALUES = {"M_u": 96.4, "I_r": 22.5, "D_u": 42.13, "D_r": 21.8}


def test_the_linear_heading_ramps_from_7_to_22_s_as_in_fig_11():
    mission = Mission("turn", tuple(legs("heading, linear")))
    before, on, after = (mission.reference(t) for t in (6.99, 14.5, 22.01))
    assert before.heading_rad == 0.0
    assert on.heading_rad == pytest.approx(TURN_RAD / 2)
    assert on.nu_dot[5] == before.nu_dot[5] == 0.0
    assert after.heading_rad == pytest.approx(TURN_RAD)
    assert after.nu[5] == 0.0


def test_the_smooth_heading_has_the_acceleration_that_an_inertia_needs_and_the_same_turn():
    mission = Mission("turn", tuple(legs("heading, smooth")))
    assert mission.reference(9.5).nu_dot[5] > 0.0
    assert mission.reference(math.inf).heading_rad == pytest.approx(TURN_RAD)


def test_the_surge_trial_holds_the_top_speed_after_the_papers_transient():
    mission = Mission("line", tuple(legs("line")))
    assert mission.reference(4.0).nu[0] == 0.0
    assert mission.reference(9.01).nu[0] == mission.reference(28.99).nu[0] == 0.5


def test_what_was_identified_is_in_force_in_its_own_configuration_only():
    parameters = carrying(FILE, "hovering", VALUES)
    assert dict(parameters.active(1)) == pytest.approx(VALUES)
    assert "M_u" not in parameters.active(0)


def test_a_value_that_no_vehicle_can_have_is_refused_with_its_name():
    with pytest.raises(ParamRejected, match=r"M_u = 1 in survey \(OUT_OF_RANGE\)"):
        carrying(FILE, "survey", {**VALUES, "M_u": 1.0})


def test_without_inertia_means_the_least_that_the_parameters_take():
    least, _ = bounds(BY_NAME["I_r"], FILE.vehicle.configurations["survey"])
    result = without_inertia(VALUES, FILE, "survey")
    assert result == {**VALUES, "I_r": least}
    assert least < 0.1 * VALUES["I_r"]
    carrying(FILE, "survey", result)
