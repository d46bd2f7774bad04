"""How far a gap shrinks, on windows made by hand, in the feed-forward, and on a check dive."""

import csv
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from fakes.planted import damped

from bench.missions.mission import draw_one
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.causes.evidence import Block, Blocks
from identify.diagnose.feedforward_gain import braking_of, feedforward_gain_by
from identify.diagnose.filters.nominal import nominal_of, quadratic_of
from identify.diagnose.gap.missing import Missing
from identify.diagnose.gap.simulation import EACH
from identify.diagnose.result import Prediction, Shrink
from identify.diagnose.shrink.check_dive import checked, flight_of, windows_of, with_coefficients
from identify.diagnose.shrink.contradiction import contradicted, contradiction_clause, contradiction_note
from identify.diagnose.shrink.held_out import HeldOutFit, without_seas
from identify.diagnose.shrink.shrink import Windows, csv_of, overstated_note
from identify.effects.environment import varying_current, waves
from identify.effects.hydrodynamics import FOULING, QUADRATIC_DRAG


def windows(before, after, count=40):
    piece = np.repeat(np.arange(count // 4), 4)
    ones = np.full((count, 6), np.nan)
    ones[:, [0, 1]] = 1.0
    return Windows(ones * before**2, ones * after**2, piece)


@pytest.mark.parametrize(
    ("before", "after", "value"), [(3.0, 2.0, 0.5), (2.0, 2.5, -0.5), (1.03, 1.0, math.nan)]
)
def test_a_shrink_is_the_share_of_what_lies_beyond_the_floor_where_anything_does(before, after, value):
    shrink = windows(before, after).shrink(np.random.default_rng(0))
    assert (shrink.before, shrink.after) == pytest.approx((before, after))
    assert (shrink.value, shrink.low95, shrink.high95) == pytest.approx((value,) * 3, nan_ok=True)


def test_what_drifts_by_less_than_noise_has_shrunk_whole_and_by_no_more():
    shrink = windows(3.0, 0.5).shrink(np.random.default_rng(0))
    assert (shrink.after, shrink.value) == pytest.approx((0.5, 1.0))
    assert np.isnan(shrink.low95)
    assert np.isnan(shrink.high95)
    assert windows(3.0, 0.9).shrink(np.random.default_rng(0)).high95 == pytest.approx(1.0)
    assert "0.50 times as far as noise" in overstated_note(shrink)[0]
    assert overstated_note(windows(3.0, 0.9).shrink(np.random.default_rng(0))) == ()


@pytest.mark.parametrize(("still", "floor", "closed"), [(1.15, 1.15, True), (2.0, 1.2, False)])
def test_where_a_cause_changes_nothing_the_floor_is_what_noise_came_to_as_far_as_chance_reaches(
    still, floor, closed
):
    sample = windows(3.0, 1.0)
    sample.before[:, 1] = sample.after[:, 1] = still**2
    shrink = sample.shrink(np.random.default_rng(0))
    assert shrink.floor == pytest.approx(np.sqrt((1.0 + floor**2) / 2))
    assert (shrink.value == pytest.approx(1.0)) is closed
    assert closed or shrink.value < 0.75


def test_a_parameter_that_one_piece_alone_tells_stays_near_what_it_is_without_that_piece():
    rng, piece = np.random.default_rng(100_321), np.repeat(np.arange(12), 50)
    slope = np.where(piece == 3, 1.0, 0.01)[:, None]
    value = rng.normal(size=len(piece))
    nothing = np.zeros(0)
    joint = SimpleNamespace(
        problems=(), slices=(), mass_indices=(), prior_precision=nothing, prior_mean=nothing
    )
    nuisance = Blocks((Block(np.zeros(0, dtype=np.intp), np.zeros((len(piece), 0))),), 0)
    rows = SimpleNamespace(piece=piece, nuisance=nuisance, nominal_precision=nothing)
    taught = HeldOutFit(rows, SimpleNamespace(joint=joint, theta=nothing), slope, value)
    by_others = float(slope[piece != 3, 0] @ value[piece != 3]) / float((slope[piece != 3] ** 2).sum())
    assert abs(by_others) > 1.0
    assert abs(taught.without(3)[1][0]) < 0.1 * abs(by_others)
    fine = HeldOutFit(rows, taught.model, np.ones_like(slope), value)
    assert fine.without(3)[1][0] == pytest.approx(value[piece != 3].mean() - value.mean(), rel=0.03)


def test_a_fold_that_tells_nothing_moves_nothing_wherever_the_filters_optimum_lies():
    piece = np.repeat(np.arange(12), 50)
    slope = np.where(piece == 3, 0.0, 1.0)[:, None]
    nothing = np.zeros(0)
    joint = SimpleNamespace(
        problems=(), slices=(), mass_indices=(), prior_precision=nothing, prior_mean=nothing
    )
    nuisance = Blocks((Block(np.zeros(0, dtype=np.intp), np.zeros((len(piece), 0))),), 0)
    rows = SimpleNamespace(piece=piece, nuisance=nuisance, nominal_precision=nothing)
    far_off = HeldOutFit(rows, SimpleNamespace(joint=joint, theta=nothing), slope, np.full(len(piece), 3.0))
    assert far_off.without(3)[1] == pytest.approx([0.0], abs=1e-6)


def test_a_gap_that_a_single_piece_makes_is_no_gap_to_be_sure_of():
    sample = windows(1.0, 1.0)
    sample.before[:4] *= 20.0
    assert np.isnan(sample.shrink(np.random.default_rng(0)).value)


def test_the_interval_holds_the_value_and_is_wider_where_pieces_differ():
    rng = np.random.default_rng(3)
    sample = windows(2.0, 1.2, 80)
    spread = Windows(sample.before * rng.gamma(2.0, 0.5, 20)[sample.piece, None], sample.after, sample.piece)
    shrink = spread.shrink(np.random.default_rng(0))
    assert shrink.low95 < shrink.value < shrink.high95
    assert shrink.high95 - shrink.low95 > 0.05


def test_the_interval_holds_what_95_of_100_dives_of_the_same_pieces_would_close():
    by_piece = 4.0 + np.random.default_rng(5).gamma(2.0, 2.0, 8)
    piece = np.repeat(np.arange(8), 2)
    squares = np.full((2, 16, 6), np.nan)
    squares[0, :, 0], squares[1, :, 0] = by_piece[piece], 1.5**2
    shrink = Windows(*squares, piece).shrink(np.random.default_rng(0))
    dice = np.random.default_rng(0)
    before = np.sqrt([by_piece[dice.integers(8, size=8)].mean() for _ in range(400)])
    low, high = np.percentile((before - 1.5) / (before - 1.0), [2.5, 97.5])
    assert (shrink.low95, shrink.high95) == pytest.approx((low, high))


def test_seas_are_noise_to_a_further_dive():
    drag = Cause(QUADRATIC_DRAG, np.array([30.0, 0, 0, 0, 0, 0]))
    sea, current = (
        Cause(sea_or_current, sea_or_current.start())
        for sea_or_current in (waves(5.0), varying_current(40.0))
    )
    assert without_seas([sea, drag, current]) == [drag]


def prediction():
    n, length = 60, 20
    measured = np.zeros((n, 6))
    measured[:, 0] = np.linspace(0.0, 0.5, n)
    window = np.repeat(np.arange(n // length), length)
    ends = np.linspace(0.0, 1.0, length)[np.arange(n) % length]
    floor = np.array([0.01, np.nan, np.nan, np.nan, np.nan, 0.002])
    off = np.outer(ends, [0.04, 0, 0, 0, 0, 0.008])
    return Prediction(
        "check",
        0.04 * np.arange(n),
        measured,
        measured + off,
        measured + 0.25 * off,
        measured + 0.5 * off,
        window,
        floor,
    )


def test_a_drift_is_what_the_last_line_of_a_window_is_off_by():
    read = windows_of(prediction())
    np.testing.assert_allclose(np.sqrt(read.before[:, [0, 5]]), 4.0)
    np.testing.assert_allclose(np.sqrt(read.after[:, [0, 5]]), 1.0)
    assert read.shrink(np.random.default_rng(0)).value == pytest.approx(1.0)


def test_the_table_holds_all_that_the_shrink_is_worked_out_from():
    text = csv_of(prediction())
    notes = [line for line in text.splitlines() if line.startswith("#")]
    rows = list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))
    assert any("surge 0.01 m/s, yaw 0.002 rad/s" in line for line in notes)
    assert any("no number where before is no more than 0.1 over floor" in line for line in notes)
    last = {row["window"]: row for row in rows}
    drifts = [
        (float(row[f"{model}_u"]) - float(row["measured_u"])) / 0.01
        for model in ("before", "after")
        for row in last.values()
    ]
    np.testing.assert_allclose(drifts, [4.0] * 3 + [1.0] * 3, atol=1e-3)
    assert set(rows[0]) == {
        "time_s", "window", "measured_u", "measured_r", "before_u", "before_r", "after_u", "after_r",
        "baseline_u", "baseline_r",
    }  # fmt: skip


def test_each_degree_of_freedom_is_told_in_its_own_unit_beside_the_plain_baseline():
    surge, yaw = checked(prediction(), np.random.default_rng(0)).by_axis
    assert (surge.dof, yaw.dof) == ("surge", "yaw")
    assert (surge.before, surge.after, surge.floor) == pytest.approx((0.04, 0.01, 0.01))
    assert surge.value == pytest.approx(1.0)
    assert surge.nrmse_after == pytest.approx(0.25 * surge.nrmse_before)
    assert surge.nrmse_baseline == pytest.approx(0.5 * surge.nrmse_before)
    spread = np.std(prediction().measured[:, 0])
    off = np.linspace(0.0, 0.04, 20)
    assert surge.nrmse_before == pytest.approx(np.sqrt(np.mean(off**2)) / spread)
    # It never turned, so there is nothing to compare an error of the rate with.
    assert np.isnan(yaw.nrmse_before)
    unchanged = prediction()
    unchanged.before[:, 5] = unchanged.after[:, 5]
    surge, yaw = checked(unchanged, np.random.default_rng(0)).by_axis
    assert surge.value == pytest.approx(1.0)
    assert np.isnan(yaw.value)


X_UU = 40.0


def test_a_quadratic_drag_brakes_by_twice_itself_times_the_speed(nominal):
    course = nominal.course
    braking = braking_of([Cause(QUADRATIC_DRAG, np.array([X_UU, 0, 0, 0, 0, 0]))], nominal)
    fast = np.abs(course.nu[::EACH, 0]) > 0.05
    expected = course.damping[0] + 2 * X_UU * np.abs(course.nu[::EACH, 0])
    np.testing.assert_allclose(braking[fast, 0], expected[fast], rtol=1e-6)
    np.testing.assert_allclose(braking[:, 1], course.damping[1])


def test_a_force_that_lasts_makes_an_error_of_what_it_is_over_what_brakes(nominal):
    count = len(nominal.course.time_s[::EACH])
    wrench = np.zeros((count, 6))
    wrench[:, 0] = 50.0
    missing = Missing(nominal.course.time_s[::EACH], wrench, np.zeros((count, 6)), wrench)
    braking = np.full((count, 6), 500.0)
    gain = feedforward_gain_by(np.zeros((count, 6)), missing, nominal, braking)
    assert gain.before_m_s == pytest.approx(np.hypot(50.0 / 500.0, gain.after_m_s), rel=0.02)
    assert gain.after_m_s < 0.02


def test_an_error_of_the_feed_forward_begins_anew_with_each_run(nominal):
    """A push at the end of the first run lasts on in a body that nothing brakes, but not into the second."""
    time_s = nominal.course.time_s[::EACH]
    half = len(time_s) // 2
    wrench = np.zeros((len(time_s), 6))
    wrench[half - 100 : half, 0] = 50.0
    one = Missing(time_s, wrench, 0.0 * wrench, wrench)
    runs = replace(one, runs_s=((time_s[0], time_s[half]), (time_s[half], time_s[-1])))
    of_one, of_two = (
        feedforward_gain_by(0.0 * wrench, missing, nominal, 0.0 * wrench).before_m_s
        for missing in (one, runs)
    )
    push = 50.0 * 100 * (time_s[1] - time_s[0]) / nominal.course.mass[0]
    assert of_one > 0.5 * push
    assert of_two < 0.2 * push


NAN = math.nan
FORETOLD = Shrink(3.0, 1.04, 0.98, 0.95, 1.0)


def measured(value: float, low: float, high: float, before: float = 3.0) -> Shrink:
    return Shrink(before, before - value * (before - 1.0), value, low, high)


@pytest.mark.parametrize(
    ("check", "speaks_against"),
    [
        (measured(0.97, 0.9, 1.0), False),
        (measured(0.6, 0.5, 0.7), False),
        (measured(0.11, 0.02, 0.2), True),
        (measured(0.0, -0.02, 0.02), True),
        (measured(-0.8, -1.2, -0.5), True),
        (measured(0.3, -0.5, 0.96), False),
        # Without a gap: by a drift that is beyond chance, and a tenth of noise larger than without them.
        (Shrink(1.02, 1.19, NAN, NAN, NAN), False),
        (Shrink(1.02, 1.21, NAN, NAN, NAN), True),
        (Shrink(1.3, 1.39, NAN, NAN, NAN), False),
        (Shrink(1.3, 1.41, NAN, NAN, NAN), True),
        (None, False),
    ],
)
def test_it_is_contradicted_by_less_than_half_of_it_beyond_chance(
    check: Shrink | None, speaks_against: bool
) -> None:
    assert contradicted(FORETOLD, check) == speaks_against
    assert (
        bool(contradiction_clause(FORETOLD, check))
        == bool(contradiction_note(FORETOLD, check))
        == speaks_against
    )


@pytest.mark.parametrize(
    ("check", "said"),
    [
        (measured(0.004, -0.02, 0.02), "98 % of the drift beyond noise was foretold to close there, and none does"),
        (measured(0.26, 0.2, 0.3), "98 % of the drift beyond noise was foretold to close there, and 26 % does"),
        (measured(0.006, -0.02, 0.02), "98 % of the drift beyond noise was foretold to close there, and 1 % does"),
        (Shrink(3.0, 4.6, -0.9, -1.2, -0.5, 1.25), "2.4 times what noise makes it without the causes, and 3.7 times"),
    ],
)  # fmt: skip
def test_what_contradicts_is_told_with_what_was_foretold_or_both_drifts(check: Shrink, said: str) -> None:
    assert said in contradiction_clause(FORETOLD, check)
    assert said in contradiction_note(FORETOLD, check)[0]


def test_what_foretells_nothing_is_not_contradicted_by_a_gap_that_stays() -> None:
    assert not contradicted(None, measured(0.0, -0.1, 0.1))
    assert not contradicted(Shrink(1.0, 1.0, NAN, NAN, NAN), measured(0.0, -0.1, 0.1))


@pytest.fixture(scope="module")
def check():
    """A dive of a hull that has quadratic drag by its vehicle file."""
    mission = draw_one(100_300, seconds=60.0)
    return nominal_of(mission.dive, damped(mission.file, "both"), mission.configuration)


def test_the_quadratic_drag_of_the_hull_itself_brakes_an_error_too(check):
    course = check.course
    slope = 2.0 * quadratic_of(check.joint, check.theta) * np.abs(course.nu[::EACH])
    np.testing.assert_allclose(braking_of([], check), course.damping + slope)


def test_a_check_dive_is_flown_with_the_quadratic_drag_of_the_diagnosed_dive_and_not_with_its_own(check):
    theta = check.theta.copy()
    for problem, of_axis in zip(check.joint.problems, check.joint.slices, strict=True):
        theta[of_axis.start + problem.quadratic_index] += np.log(3.0)
    flown = with_coefficients(check, replace(check, theta=theta))
    expected = 3.0 * quadratic_of(check.joint, check.theta)
    np.testing.assert_allclose(quadratic_of(check.joint, flown), expected)


def test_the_causes_on_a_check_dive_act_on_a_hull_with_the_diagnosed_dive_s_quadratic_drag(check):
    quadratic = 3.0 * check.course.quadratic
    now = replace(check, course=replace(check.course, quadratic=quadratic))
    fouled = flight_of(now, [Cause(FOULING, np.array([1e-4]))], check, check)
    np.testing.assert_array_equal(fouled.course.quadratic, quadratic)
