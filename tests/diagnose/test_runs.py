"""A diagnosis of several short runs: the causes of a dive cut into runs, and nothing that spans two of them."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from fakes.planted import diagnosed, planted_nominal, quiet

from bridge.errors import FitError
from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import Water
from identify.challenge.case import dive_of, draw_case
from identify.checks.sensors.descent import descent
from identify.checks.sensors.windows import within_runs
from identify.diagnose.cleaned import refuse_short_runs
from identify.diagnose.diagnose import diagnose
from identify.diagnose.filters.innovations import autoregressions_of
from identify.diagnose.filters.regression import pieces_of, regression_of
from identify.diagnose.gap.simulation import EACH, simulation_of, smoothed_angle
from identify.diagnose.remainder.bursts import bursts
from identify.diagnose.shrink.held_out import held_windows, stitched_windows
from identify.dive import Dive, Signal
from identify.effects.environment import STEADY_CURRENT
from identify.effects.hydrodynamics import QUADRATIC_DRAG
from identify.run.joined_runs import joined

SECONDS = 15.0


def runs_of(dive, count=8):
    start_s = dive.span_s[0]
    starts_s = [start_s + SECONDS * k for k in range(count)]
    return joined(
        [
            replace(
                dive.between(at_s, at_s + SECONDS), name=f"run {k}", source=Path(f"{k}.tlog"), sha256=f"{k}"
            )
            for k, at_s in enumerate(starts_s)
        ]
    )


CASE = draw_case(300055, names=["quadratic_drag"], seconds=120.0)
PLAIN = draw_case(300051, names=[], seconds=120.0)


@pytest.fixture(scope="module")
def nominal():
    return planted_nominal(PLAIN, runs_of(dive_of(PLAIN)))


def test_the_cause_of_a_gap_is_found_in_runs_of_15_s():
    diagnosis = diagnosed(CASE, QUADRATIC_DRAG, STEADY_CURRENT, dive=runs_of(dive_of(CASE)))
    assert diagnosis.verdict == "explained"
    assert [finding.cause.effect.name for finding in diagnosis.findings] == ["quadratic_drag"]
    assert diagnosis.heldout.after == pytest.approx(1.0, abs=0.2)
    assert [drift.horizon_s for drift in diagnosis.gap.after] == [1.0, 5.0]


def test_runs_without_a_gap_drift_by_noise_alone():
    diagnosis = diagnosed(PLAIN, QUADRATIC_DRAG, STEADY_CURRENT, dive=runs_of(dive_of(PLAIN)))
    assert diagnosis.verdict == "no_gap"
    assert 0.8 < diagnosis.gap.before < 1.2


def test_runs_have_one_trim_in_common_as_a_steady_push_is_a_cause(nominal):
    for problem in nominal.joint.problems:
        assert len(problem.axis.runs) == 8
        assert problem.axis.trims == 1


def test_no_window_of_the_drift_spans_two_runs(nominal):
    model = simulation_of(nominal, nominal.theta, nominal.motion.nu)
    steps = round(5.0 / model.step_s)
    off = model.off(np.arange(len(model.time_s)), [steps], np.zeros_like(model.nu))[:, 0, model.dofs[0]]
    for at in np.flatnonzero(np.isfinite(off)).tolist():
        start_s, end_s = model.time_s[at], model.time_s[at + steps]
        assert any(first_s <= start_s and end_s <= last_s for first_s, last_s in nominal.joint.runs_s)
    assert 0 < np.count_nonzero(np.isfinite(off)) < 0.7 * len(off)
    for fold in range(12):
        starts = stitched_windows(model, fold)
        assert np.isfinite(off[starts]).all()
        assert np.isfinite(off[held_windows(model, fold)[0]]).all()


def test_nothing_is_missing_between_runs(nominal):
    model = simulation_of(nominal, nominal.theta, nominal.motion.nu)
    between = ~nominal.course.recorded[::EACH]
    assert between.any()
    assert not model.lacking[between].any()


def test_no_piece_that_is_held_out_spans_two_runs(nominal):
    rows = regression_of(nominal.joint, nominal.theta, ())
    time_s = np.concatenate([axis.problem.axis.time_s[axis.read] for axis in rows.axes])
    run = np.searchsorted([start_s for start_s, _ in nominal.joint.runs_s], time_s, side="right")
    for piece in np.unique(rows.piece):
        assert len(np.unique(run[rows.piece == piece])) == 1


def test_windows_that_are_held_out_lie_in_a_piece_of_their_fold_a_second_apart():
    time_s = 0.5 * np.arange(601)
    model = SimpleNamespace(time_s=time_s, step_s=0.5, runs=[slice(0, 601)], runs_s=())
    piece = pieces_of(time_s, ((0.0, 300.0),))
    found = [held_windows(model, fold) for fold in range(12)]
    within = [at for at in range(0, 590, 2) if piece[at] == piece[at + 10]]
    assert sorted(at for starts, _ in found for at in starts.tolist()) == within
    for fold, (starts, pieces) in enumerate(found):
        np.testing.assert_array_equal(pieces, piece[starts])
        assert {*(pieces % 12).tolist()} == {fold}


def test_runs_are_held_out_in_equal_pieces_as_long_as_those_of_a_short_dive():
    runs_s = ((0.0, 15.0), (18.0, 25.0), (28.0, 58.0))
    time_s = np.array([0.0, 7.4, 7.6, 15.0, 16.0, 18.0, 25.0, 28.0, 33.9, 34.1, 58.0])
    assert pieces_of(time_s, runs_s).tolist() == [0, 0, 1, 1, 1, 2, 2, 3, 3, 4, 7]


def test_no_innovation_is_foretold_from_the_run_before():
    rng = np.random.default_rng(1)
    values = np.repeat([5.0, -5.0], 500) + rng.normal(size=1000)
    values[1:500] += 0.5 * values[:499]
    runs = [np.arange(500), np.arange(500, 1000)]
    first, second = autoregressions_of(runs, values)
    assert first.by_lag is second.by_lag
    whitened = values[:, None].copy()
    for autoregression in (first, second):
        autoregression.prewhitened(whitened)
    assert whitened[500, 0] == values[500]


def test_an_angle_is_averaged_within_its_run():
    time_s = np.arange(0.0, 20.0, 0.04)
    runs_s = ((0.0, 8.0), (11.0, 19.9))
    angle, rate = np.where(time_s < 9.5, 1.0, -2.0), np.zeros(len(time_s))
    smoothed = smoothed_angle(time_s, time_s, angle, rate, runs_s)
    inside = (time_s < 8.0) | ((time_s >= 11.0) & (time_s < 19.9))
    np.testing.assert_allclose(smoothed[inside], angle[inside], atol=1e-12)
    assert not smoothed[(time_s > 8.1) & (time_s < 10.9)].any()


def test_the_silence_between_runs_is_no_lull_among_bursts(nominal):
    axes = regression_of(nominal.joint, nominal.theta, ()).axes
    runs_s, time_s = nominal.course.runs_s, nominal.course.time_s
    gains = []
    for seed in range(7):
        rng = np.random.default_rng(seed)
        left = {axis.problem.axis.dof: (axis, rng.normal(size=len(axis.std))) for axis in axes}
        best = max(bursts(left, time_s, runs_s), key=lambda burst: burst.gain)
        gains.append(best.gain)
        assert not best.force(time_s)[~nominal.course.recorded].any()
    assert np.median(gains) < 3.0


def test_runs_that_are_all_too_short_are_refused():
    dive = dive_of(PLAIN)
    short = [replace(dive.between(6.0 * k, 6.0 * k + 5.0), name=f"{k}", sha256=f"{k}") for k in range(8)]
    with pytest.raises(FitError, match=r"the longest of its 8 runs lasts 5.0 s.*give runs of 8 s or more"):
        refuse_short_runs(joined(short))
    with pytest.raises(FitError, match="give runs of 8 s or more"):
        diagnose(joined(short), PLAIN.file, PLAIN.configuration, progress=quiet)


def test_a_window_that_holds_a_break_or_has_it_at_an_edge_compares_no_sensors():
    edges_s = np.arange(0.0, 60.0, 10.0)
    assert within_runs(edges_s, np.zeros(0)).all()
    assert within_runs(edges_s, np.array([15.0])).tolist() == [True, False, True, True, True]
    assert within_runs(edges_s, np.array([20.3]), 0.5).tolist() == [True, False, False, True, True]


def test_depth_and_velocity_agree_though_the_vehicle_was_lifted_between_runs():
    """Most windows hold a break, at which depth jumps."""
    time_s = np.arange(0.0, 12.0, 0.1)
    sinking = 0.3 * np.sin(0.5 * time_s)
    level = np.tile([1.0, 0.0, 0.0, 0.0], (120, 1))
    runs = [
        Dive(
            f"{k}",
            Path(f"{k}.tlog"),
            f"{k}",
            velocity=Signal(time_s, np.column_stack([np.zeros((120, 2)), sinking])),
            attitude=Signal(time_s, level),
            depth=Signal(time_s, (4.0 * (k % 3) + 0.6 * (1.0 - np.cos(0.5 * time_s)))[:, None]),
        )
        for k in range(30)
    ]
    scale = descent(joined(runs), Water())
    assert scale is not None
    assert scale.least == pytest.approx(1.0, abs=0.01)


def test_every_degree_of_freedom_was_read_in_every_run(nominal):
    assert {DOFS[problem.axis.dof] for problem in nominal.joint.problems} >= {"surge", "sway", "heave", "yaw"}
    assert len(nominal.joint.runs_s) == 8
