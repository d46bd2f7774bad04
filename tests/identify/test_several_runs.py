"""Several runs as one dive: how they are joined, what differs between them, and ballast that changed."""

import json
from dataclasses import replace
from pathlib import Path

import closed_loop
import network_tasks
import numpy as np
import pytest

from bench.missions.mission import draw_one
from bridge import exit_codes
from bridge.errors import FitError, LogError
from bridge.vehicle.config import Water, load_vehicle
from identify.dive import Dive, Signal
from identify.estimators.axes.build import build_axes
from identify.estimators.filter.innovations import innovations, smoothed_velocity
from identify.estimators.filter.state import VELOCITY
from identify.estimators.filter.transitions import transitions
from identify.estimators.likelihood.answer import estimate
from identify.estimators.likelihood.axis import FORCES
from identify.estimators.likelihood.priors import likelihood_of
from identify.estimators.mass_by_run import Kinds, unlike_doubts
from identify.estimators.missing_forces.forms import Kind
from identify.estimators.missing_forces.screening import Lack
from identify.run.joined_runs import ballast_note, joined, together
from identify.run.recordings import Reading
from identify.thrust.wrench import wrench
from tui import cli

FILE = closed_loop.vehicle_file()


def named(dive, name):
    return replace(dive, name=name, source=Path(f"{name}.tlog"), sha256=f"sha of {name}")


def cut(dive, *spans_s):
    return [named(dive.between(*span_s), f"run {span_s[0]:g}") for span_s in spans_s]


def run(seed, seconds=15.0, **how):
    return named(closed_loop.dive(np.random.default_rng(seed), seconds, **how), f"run {seed}")


def read(*dives, file=FILE):
    return [Reading(dive, file, ()) for dive in dives]


def identified(dive):
    return estimate(dive, FILE, "only", network_tasks.quiet)


def test_what_the_filter_knows_ends_with_a_run():
    rng = np.random.default_rng(1)
    table = transitions(
        np.array([0.02, 0.05]),
        40.0,
        np.array([20.0]),
        0.0,
        np.full(2, 2.0),
        3.0,
        0.3,
        np.zeros(2),
        0.0,
        1.0,
        0.0,
    )
    step, count = rng.integers(0, 2, 200), 120
    step[0], step[count] = -1, -2
    force, reading = rng.normal(0.0, 5.0, (200, 2)), rng.normal(0.0, 0.1, 200)
    initial = np.array([[0.1, 0.0, 0.01, 0.01], [-0.2, 0.0, 0.04, 0.01]])
    read_of = np.full(200, VELOCITY)

    def run_of(part, steps, began):
        of_each = (
            table,
            steps,
            force[part],
            reading[part],
            read_of[part],
            np.full(len(steps), 1e-4),
            2.0,
            2.1,
            False,
        )
        return (*innovations(*of_each, began, np.inf)[:2], smoothed_velocity(*of_each, began))

    both = run_of(slice(None), step, initial)
    second = step[count:].copy()
    second[0] = -1
    parts = run_of(slice(count), step[:count], initial[:1]), run_of(slice(count, None), second, initial[1:])
    for whole, *each in zip(both, *parts, strict=True):
        assert np.array_equal(whole, np.concatenate(each))


@pytest.fixture(scope="module")
def survey():
    """A drawn dive of a whole vehicle, three runs of it, and those behind one another."""
    drawn = draw_one(100_300, seconds=120.0)
    runs = cut(drawn.dive, (0.0, 40.0), (40.0, 75.0), (75.0, 130.0))
    return drawn, runs, joined(runs)


def problems(drawn, dive):
    shape = drawn.file.vehicle.configurations[drawn.configuration]
    masses = np.array([1.4 * shape.rigid_body(dof)[0] for dof in range(6)])
    axes = build_axes(dive, drawn.file, drawn.configuration).axes
    return {axis.dof: likelihood_of(axis, shape, masses, ()) for axis in axes}


def test_the_likelihood_and_the_score_of_runs_together_are_the_sums_of_those_alone(survey):
    drawn, runs, dive = survey
    trims = (0.3, -0.2, 0.1)
    whole, alone = problems(drawn, dive), [problems(drawn, part) for part in runs]
    assert set(whole) == {0, 1, 2, 3, 4, 5}
    for dof, problem in whole.items():
        theta = problem.prior_mean.copy()
        theta[FORCES : FORCES + 3] = trims
        gradient, information = problem.score(theta)
        value, slope, bend = 0.0, 0.0, 0.0
        for k, trim in enumerate(trims):
            of_part = np.concatenate([theta[:FORCES], [trim], theta[FORCES + 3 :]])
            part = alone[k][dof]
            value += part.log_likelihood(of_part)
            by_own, of_own = part.score(of_part)
            slope, bend = slope + by_own[0], bend + of_own[0, 0]
            assert gradient[FORCES + k] == pytest.approx(by_own[FORCES], rel=1e-4, abs=1e-3)
        # Readings of a DVL before the thrust is known are smoothed with the rest of the run alone: hardly a difference.
        exactly = 1e-9 if dof > 2 else 3e-5
        assert problem.log_likelihood(theta) == pytest.approx(value, rel=exactly)
        assert gradient[0] == pytest.approx(slope, rel=1e-4)
        assert information[0, 0] == pytest.approx(bend, rel=1e-4)
        assert not information[FORCES, FORCES + 1 : FORCES + 3].any()


def test_the_speed_that_the_readings_show_is_that_of_each_run_alone(survey):
    drawn, runs, dive = survey
    problem = problems(drawn, dive)[5]
    parts = [problems(drawn, part)[5] for part in runs]
    theta = problem.prior_mean
    of_part = np.delete(theta, [FORCES + 1, FORCES + 2])
    speeds = np.concatenate([part.speed(of_part) for part in parts])
    np.testing.assert_allclose(problem.speed(theta), speeds, atol=1e-10)


def test_thrust_does_not_lag_from_one_run_into_the_next(survey):
    drawn, runs, dive = survey
    file, name = drawn.file, drawn.configuration
    forces = wrench(dive, file, name)
    for part, of_run in zip(runs, dive.runs, strict=True):
        alone, by_s = wrench(part, file, name), of_run.start_s - part.span_s[0]
        at_s = np.arange(part.span_s[0] - 1.0, part.span_s[1], 0.013)
        np.testing.assert_allclose(forces.at(at_s + by_s), alone.at(at_s), atol=1e-6)
        halves = forces.halves_between(at_s[:-1] + by_s, at_s[1:] + by_s)
        np.testing.assert_allclose(halves, alone.halves_between(at_s[:-1], at_s[1:]), atol=1e-3)


def test_a_dive_cut_into_runs_tells_the_same_a_little_less_surely():
    dive = closed_loop.dive(np.random.default_rng(5), 180.0)
    whole, runs = identified(dive), identified(joined(cut(dive, (0, 60), (60, 120), (120, 180))))
    for name in ("M_u", "D_u"):
        assert abs(runs[name].value - whole[name].value) < 0.5 * whole[name].std
        assert 1.0 < runs[name].std / whole[name].std < 1.2


def heavier(dive, times):
    """The run of a vehicle that needs so many times the thrust for the same motion."""
    return replace(dive, tau_cmd=Signal(dive.tau_cmd.time_s, times * dive.tau_cmd.value))


def test_runs_of_a_second_vehicle_are_named_and_those_of_one_vehicle_are_not():
    runs = [run(seed, 20.0) for seed in range(6)]
    of_two = [heavier(each, 1.5) if k in (1, 2, 4) else each for k, each in enumerate(runs)]
    (doubt,) = (each for each in identified(joined(of_two)).doubts if "heavy" in each.problem)
    assert "In surge the runs run 1, run 2 and run 4 respond as if about 1." in doubt.problem
    assert doubt.problem.endswith("times as heavy as the other 3")
    assert doubt.about == ("M_u", "D_u")
    ballasted = [heavier(each, 1.16) if k in (1, 2, 4) else each for k, each in enumerate(runs)]
    spread = [heavier(each, 1.0 + 0.02 * k) for k, each in enumerate(runs)]
    for alike in (runs, ballasted, spread, of_two[:4]):
        assert not any("heavy" in each.problem for each in identified(joined(alike)).doubts)


def test_runs_that_lack_a_force_of_other_axes_thrust_are_not_taken_for_two_vehicles():
    kinds = {0: Kinds(("run 1", "run 2"), 1.4, 5), 5: Kinds(("run 1", "run 2"), 1.3, 5)}
    (doubt,) = unlike_doubts(kinds, ())
    assert doubt.problem.startswith("In surge and yaw the runs run 1 and run 2 respond as if about 1.4")
    lacks = [Lack(dof, kind, 50.0, np.ones(3)) for dof, kind in ((5, Kind.ACROSS), (0, Kind.THRUST))]
    (doubt,) = unlike_doubts(kinds, lacks)
    assert doubt.about == ("M_u", "D_u")


def test_runs_that_each_lean_on_another_trim_do_not_spoil_the_mass():
    leans = (8.0, -8.0, 4.0, -4.0)
    runs = [run(seed, 30.0, push=lambda _t, _f, lean=lean: lean) for seed, lean in enumerate(leans)]
    both = identified(joined(runs))
    assert both["M_u"].low95 < closed_loop.MASS < both["M_u"].high95
    assert both["D_u"].low95 < closed_loop.DAMPING < both["D_u"].high95


def test_the_order_in_which_runs_are_given_does_not_matter():
    runs = [run(seed, 25.0) for seed in range(3)]
    first, second = (together(read(*order)) for order in (runs, runs[::-1]))
    assert [part.name for part in first.dive.runs] == ["run 0", "run 1", "run 2"]
    assert identified(first.dive)["M_u"] == identified(second.dive)["M_u"]


def test_dated_runs_stand_in_order_of_time():
    early, late = replace(run(1), unix_at_boot_s=2e9), replace(run(0), unix_at_boot_s=2.1e9)
    dive = together(read(late, early)).dive
    assert [part.name for part in dive.runs] == ["run 1", "run 0"]


def test_runs_lie_behind_one_another_with_a_break_between():
    dive = joined([run(0, 30.0), run(1, 20.0)])
    first, second = dive.runs
    assert second.start_s - first.end_s >= 3.0
    (break_s,) = dive.breaks_s
    assert first.end_s < break_s < second.start_s
    assert dive.duration_s == pytest.approx(49.8)
    assert len(dive.velocity) == 500
    assert dive.notes[0] == "2 runs are one dive of 50 s: run 0 and run 1."


def test_a_part_of_a_dive_keeps_the_runs_that_it_holds():
    dive = joined([run(seed) for seed in range(3)])
    part = dive.between(dive.runs[1].start_s + 1.0, np.inf)
    assert [held.name for held in part.runs] == ["run 1", "run 2"]
    assert part.duration_s == pytest.approx(28.8)


def test_without_any_run_that_pushed_there_is_no_dive():
    still = [run(seed) for seed in (1, 2)]
    still = [replace(d, tau_cmd=Signal(d.tau_cmd.time_s, np.zeros((len(d.tau_cmd), 6)))) for d in still]
    with pytest.raises(FitError, match=r"no run of 2 can be used; of the first, run 1: no thruster pushed"):
        together(read(*still))


def test_the_same_recording_twice_is_refused():
    with pytest.raises(LogError, match=r"run 1.tlog and run 1.tlog hold the same recording"):
        together(read(run(1), run(1)))


def test_two_recordings_of_the_same_time_are_refused():
    first, other = (replace(run(seed), unix_at_boot_s=2e9 + 5.0 * seed) for seed in (0, 1))
    with pytest.raises(LogError, match=r"were recorded at the same time.*seatrial merge"):
        together(read(first, other))


def test_runs_of_vehicles_with_other_thrusters_are_refused():
    time_s = np.arange(0.0, 15.0, 0.1)
    four, six = (
        replace(run(seed), pwm=Signal(time_s, np.full((150, count), 1600.0)))
        for seed, count in ((0, 4), (1, 6))
    )
    with pytest.raises(LogError, match=r"run 1.tlog: has 6 thruster commands in us.*has 4.*one vehicle"):
        together(read(four, six))


def test_runs_in_other_water_are_refused():
    other = replace(FILE, vehicle=replace(FILE.vehicle, water=Water(density_kg_m3=1025.0)))
    with pytest.raises(LogError, match="other conditions"):
        together([*read(run(0)), *read(run(1), file=other)])


def test_a_signal_that_a_run_lacks_is_left_out_of_all_and_named():
    dive = joined([run(0), replace(run(1), nu_ref=None)])
    assert dive.nu_ref is None
    assert "The runs' nu_ref was left out, as 1 of them lacks it, first run 1." in dive.notes


@pytest.mark.parametrize("others_first", [False, True])
def test_what_is_known_of_one_runs_commands_and_stamps_alone_is_not_taken_for_all(others_first):
    runs = [replace(run(0), commands_hold=True), replace(run(1), stamped_s=0.025)]
    dive = joined(runs[::-1] if others_first else runs)
    assert dive.commands_hold is None
    assert dive.stamped_s == 0.025
    assert joined([replace(each, commands_hold=False) for each in runs]).commands_hold is False


def test_a_single_recording_stays_as_it_is():
    (reading,) = read(run(0))
    assert together([reading]) is reading


VEHICLE = (Path(__file__).resolve().parents[1] / "data" / "vehicles" / "one_axis.yaml").read_text("utf-8")
COLUMNS = """\
time: {column: t}
velocity: {columns: [u, null, null], unit: m/s}
pwm: {columns: [X], unit: N}
"""


def table(path, seed, seconds=15.0, thrust=1.0):
    """A run of the closed loop as CSV; its times begin anew in each."""
    dive = closed_loop.dive(np.random.default_rng(seed), seconds)
    columns = (dive.velocity.time_s, dive.velocity.value[:, 0], thrust * dive.tau_cmd.value[:, 0])
    lines = ["t,u,X", *(",".join(f"{value:.9g}" for value in row) for row in zip(*columns, strict=True))]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.fixture
def folder(tmp_path):
    """A vehicle file, a column map, and a folder of five runs of 15 s."""
    (tmp_path / "vehicle.yaml").write_text(VEHICLE, encoding="utf-8")
    (tmp_path / "columns.yaml").write_text(COLUMNS, encoding="utf-8")
    (tmp_path / "runs").mkdir()
    for seed in range(5):
        table(tmp_path / "runs" / f"run{seed}.csv", seed)
    return tmp_path


def seatrial(verb, folder, *words):
    more = ("--vehicle", folder / "vehicle.yaml", "--columns", folder / "columns.yaml")
    return cli.main([verb, *map(str, (*words, *more))])


def said(capsys):
    return " ".join(capsys.readouterr().err.split())


def test_a_folder_of_runs_is_identified_as_one_dive(folder, capsys):
    out = folder / "hull.json"
    assert seatrial("identify", folder, folder / "runs", "--together", "--json", out) == exit_codes.DONE
    answer = json.loads(out.read_text(encoding="utf-8"))
    assert [run["name"] for run in answer["runs"]["used"]] == [f"run{seed}" for seed in range(5)]
    assert answer["runs"]["left_out"] == {}
    by_name = {parameter["name"]: parameter for parameter in answer["parameters"]}
    assert by_name["M_u"]["low95"] < closed_loop.MASS < by_name["M_u"]["high95"]
    assert by_name["D_u"]["low95"] < closed_loop.DAMPING < by_name["D_u"]["high95"]
    printed = " ".join(capsys.readouterr().out.split())
    assert "5 runs, run0 to run4: likelihood" in printed
    assert "5 runs are one dive of 74 s: run0, run1, run2, run3 and run4." in printed


def test_a_run_without_a_push_is_named_in_what_is_written(folder):
    table(folder / "runs" / "adrift.csv", 9, thrust=0.0)
    out = folder / "hull.json"
    assert seatrial("identify", folder, folder / "runs", "--together", "--json", out) == exit_codes.DONE
    runs = json.loads(out.read_text(encoding="utf-8"))["runs"]
    assert len(runs["used"]) == 5
    assert runs["left_out"]["adrift"].startswith("no thruster pushed in all the dive")


@pytest.mark.usefixtures("sketched")
def test_the_page_names_each_run_with_its_file(folder):
    page = folder / "report.html"
    assert seatrial("identify", folder, folder / "runs", "--together", "--report", page) == exit_codes.DONE
    html = page.read_text(encoding="utf-8")
    provenance = html[html.index("<h2>Provenance</h2>") :]
    assert all(f"run{seed}.csv" in provenance for seed in range(5))


def test_a_folder_of_runs_without_together_is_refused_with_what_to_give(folder, capsys):
    assert seatrial("identify", folder, folder / "runs") == exit_codes.BAD_INPUT
    assert "runs: holds 5 recordings; name one of them, or give --together" in said(capsys)


@pytest.mark.parametrize("method", ["pinn", "likelihood+pinn"])
def test_another_method_than_the_likelihood_is_refused(folder, method, capsys):
    words = (folder / "runs", "--together", "--method", method)
    assert seatrial("identify", folder, *words) == exit_codes.BAD_INPUT
    assert "several runs together are identified by likelihood alone" in said(capsys)


def test_several_recordings_are_one_diagnosis(folder, capsys):
    out = folder / "gap.json"
    runs = [folder / "runs" / f"run{seed}.csv" for seed in (3, 1, 2)]
    assert seatrial("diagnose", folder, *runs, "--json", out) == exit_codes.DONE
    answer = json.loads(out.read_text(encoding="utf-8"))
    assert [run["name"] for run in answer["runs"]["used"]] == ["run1", "run2", "run3"]
    assert "3 runs are one dive of 45 s: run1, run2 and run3." in " ".join(capsys.readouterr().out.split())


def test_a_run_that_is_diagnosed_is_no_check(folder, capsys):
    words = (folder / "runs", "--check", folder / "runs" / "run3.csv")
    assert seatrial("diagnose", folder, *words) == exit_codes.BAD_INPUT
    assert "so it can't show how far the gap shrinks" in said(capsys)


def test_a_simulators_run_that_is_too_short_alone_is_named_however_many_are_held_against_it(folder, capsys):
    runs = [folder / "runs" / f"run{seed}.csv" for seed in range(3)]
    assert seatrial("diagnose", folder, *runs[:2], "--against", runs[2]) == exit_codes.NO
    assert f"{runs[2]}: lasts 14 s, too short" in said(capsys)


HEAVY = load_vehicle("bluerov2_heavy")
MASS_KG, DRAG, TURNING_KG = 30.0, 40.0, 20.0


def lap(number, weight_n, seconds=15.0, **without):
    """A lap with steps of depth, pitching on its way, driven by wrenches that know all but the sea's noise."""
    rng = np.random.default_rng(number)
    time_s = np.arange(0.0, seconds, 0.05)
    rate, phase = rng.uniform(0.5, 1.5, 2), rng.uniform(0.0, 6.0, 2)
    w, dw = (0.3 * turned(rate[0] * time_s + phase[0]) for turned in (np.sin, np.cos))
    u, q = 0.5 + 0.2 * np.sin(rate[1] * time_s), 0.2 * np.cos(rate[1] * time_s + phase[1])
    down = MASS_KG * rate[0] * dw + DRAG * np.abs(w) * w - TURNING_KG * u * q - weight_n
    still = np.zeros_like(w)
    velocity = np.column_stack([u, still, w]) + rng.normal(0.0, 0.003, (len(w), 3))
    commanded = np.column_stack([20.0 * np.sin(time_s), still, down, still, still, still])
    signals = {
        "velocity": Signal(time_s, velocity),
        "gyro": Signal(time_s, np.column_stack([still, q, still])),
        "tau_cmd": Signal(time_s, commanded),
    }
    return Dive(f"lap {number}", Path(f"lap{number}.csv"), f"sha of {number}", **(signals | without))


def said_of(laps):
    return ballast_note(joined(laps), HEAVY, "heavy")


def test_the_runs_that_are_heavier_in_the_water_are_named_with_their_weight():
    laps = [lap(number, weight_n=3.0 if number in (2, 5, 6) else -1.0) for number in range(8)]
    (sentence,) = said_of(laps)
    assert sentence.startswith("In the water, lap 2, lap 5, lap 6 are heavier by 4.0 N than the other runs")
    dive = together([Reading(each, HEAVY, ()) for each in laps]).dive
    assert sentence in dive.notes


@pytest.mark.parametrize(
    "weights_n",
    [[1.0] * 8, [1.0, 1.2] * 4, [0.0, 0.0, 3.0, 0.0], [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]],
    ids=["alike", "less apart than a bubble", "too few", "a little heavier each time"],
)
def test_runs_of_one_kind_are_not_named(weights_n):
    assert said_of([lap(number, weight_n) for number, weight_n in enumerate(weights_n)]) == ()


def test_without_a_velocity_or_a_gyro_nothing_is_said():
    for missing in ("velocity", "gyro"):
        assert said_of([lap(k, 4.0 * (k > 3), **{missing: None}) for k in range(8)]) == ()
