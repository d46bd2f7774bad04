"""Forces of hull, body, water and tether, on motions known by heart, and the feed-forward against them."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bridge.vehicle.accepted_effects import Losses
from bridge.vehicle.config import GRAVITY_M_S2
from bridge.vehicle.dynamics import coriolis, restoring
from bridge.vehicle.feedforward import hull_wrench
from bridge.vehicle.references import Reference
from identify.effects import actuators, environment, hydrodynamics, rigid_body, sensors, supply
from identify.effects.course import Course
from identify.effects.effect import Effect

Made = Callable[..., Course]
DRY_KG = 72.0


def wrench(effect: Effect, course: Course, *values: float, at: int = -1) -> np.ndarray:
    result = effect.act(course, np.array(values)).wrench
    return result[at]


RIGHTING, LOW_MASS, LOW_THRUST, LOW_HULL, LOW_WATER = rigid_body.PITCH_ROLL_COUPLING
SHAKEN = {"nu_dot": [1, 1, 1, 0, 0, 0], "depth_m": 0.5, "altitude_m": 2.0}
HEAVIER = 0.2 * np.array([0.25 * 38, 58, 68, 0, 0, 0])
FARTHER = (0.5**2 + 0.25**2) / (2.0**2 + 0.25**2)
SLIDING = {"nu": [0, 0.3, 0, 0, 0, 0], "depth_m": 0.5, "altitude_m": 0.5}
PULL_N = 0.5 * 0.2 * 2 * 0.5 / (0.5**2 + 0.25**2) * 0.3**2
"""Of each kilogram of added mass, half of what it grows by with each metre nearer times the speed squared."""


def test_a_drag_that_comes_later_than_the_speed_is_no_longer_drag_by_its_square(rich_course: Course) -> None:
    drag = hydrodynamics.QUADRATIC_DRAG.act(rich_course, np.full(6, 2.0))
    late = drag.each(lambda part: np.roll(part, 4, axis=0))
    np.testing.assert_allclose(late.wrench[4:], drag.wrench[:-4])
    # The filters brake by `quadratic`, if there is any, and not by the wrench.
    assert drag.quadratic is not None
    assert late.quadratic is None


@pytest.mark.parametrize(
    ("effect", "motion", "values", "expected"),
    [
        (hydrodynamics.QUADRATIC_DRAG, {"nu": [0.5, -0.2, 0.1, 0.3, -0.4, 0.5]}, (30, 20, 10, 1, 2, 3),
         [-7.5, 0.8, -0.1, -0.09, 0.32, -0.75]),
        (hydrodynamics.COUPLED_DAMPING, {"nu": [0.5, 0.2, 0, 0, 0, -0.3]}, (2, 4), [0, 0.6, 0, 0, 0, -0.8]),
        (hydrodynamics.CROSS_FLOW_LIFT, {"nu": [-0.5, 0.2, 0, 0, 0, 0]}, (10, 5), [0, -1, 0, 0, 0, -0.5]),
        # Felt astern alone.
        (hydrodynamics.DRAG_ASYMMETRY, {"nu": 0.4}, (1.5,), [0] * 6),
        (hydrodynamics.DRAG_ASYMMETRY, {"nu": -0.4}, (1.5,), [0.5 * 50 * 0.4, 0, 0, 0, 0, 0]),
        # The nose comes down as a low mass lags behind, and up as thrust acts low.
        (LOW_MASS, {"nu_dot": [0.5, 0, 0, 0, 0, 0]}, (0.02,), [0, 0, 0, 0, -DRY_KG * 0.02 * 0.5, 0]),
        (LOW_THRUST, {"asked_n": [10] * 4 + [0] * 4}, (0.02,), [0, 0, 0, 0, 0.02 * 40 * 0.82904, 0]),
        (rigid_body.NET_BUOYANCY, {}, (3,), [0, 0, -3, 0, 0, 0]),
        (rigid_body.THRUST_BIAS, {}, (1, 2, 3, 4), [1, 2, 3, 0, 0, 4]),
        # A boundary makes a body heavier by its distance squared, draws one that slides past it, holds off one that
        # nears it by half of the momentum that its water gains, and does nothing where nobody measures it.
        (environment.FREE_SURFACE, SHAKEN, (0.2, 0), -HEAVIER),
        (environment.BOTTOM_OR_WALL, SHAKEN, (0.2, 0), -FARTHER * HEAVIER),
        (environment.BOTTOM_OR_WALL, SHAKEN, (0.2, 0.2), -FARTHER * HEAVIER),
        (environment.FREE_SURFACE, SLIDING, (0, 0.2), [0, 0, -58 * PULL_N, 0, 0, 0]),
        (environment.BOTTOM_OR_WALL, SLIDING, (0, 0.2), [0, 0, 58 * PULL_N, 0, 0, 0]),
        (environment.BOTTOM_OR_WALL, {"nu": [0, 0, 0.3, 0, 0, 0], "altitude_m": 0.5}, (0, 0.2),
         [0, 0, -68 * PULL_N, 0, 0, 0]),
        *[(effect, {"nu": 0.2, "nu_dot": 1.0}, (0.2, 0.2), [0] * 6) for effect in environment.SURFACES],
        # A tether pulls back to where the dive began.
        (environment.TETHER, {"position_m": [10, -4], "euler": [0, 0, np.pi]}, (0.5, 1, 0), [4, -2, 0, 0, 0, 0]),
    ],
    ids=lambda given: getattr(given, "label", ""),
)  # fmt: skip
def test_on_a_motion_known_by_heart_an_effect_pushes_as_its_law_says(
    course: Made, effect: Effect, motion: dict[str, Any], values: tuple[float, ...], expected: Sequence[float]
) -> None:
    assert wrench(effect, course(**motion), *values) == pytest.approx(np.array(expected))


def test_a_munk_moment_twice_as_large_adds_what_the_dynamics_hold_already(course: Made) -> None:
    moving = course(nu=[0.5, 0.2, -0.1, 0, 0, 0])
    nominal = -np.array(coriolis(moving.mass.tolist(), moving.nu[0]))
    assert wrench(hydrodynamics.MUNK_MOMENT, moving, 2.0) == pytest.approx(nominal)
    assert wrench(hydrodynamics.MUNK_MOMENT_IN_YAW, moving, 2.0) == pytest.approx([0] * 5 + [nominal[5]])
    assert nominal[5] == pytest.approx(-(130.0 - 110.0) * 0.5 * 0.2)


def test_moments_go_by_the_drift_that_all_readings_show_and_forces_by_what_is_expected(course: Made) -> None:
    expected = course(nu=[0.5, 0.2, -0.1, 0, 0, 0])
    shown = replace(expected, drift=np.tile([0.4, 0.3, -0.2], (len(expected.time_s), 1)))
    lift = wrench(hydrodynamics.CROSS_FLOW_LIFT, shown, 10.0, 5.0)
    assert lift == pytest.approx([0, -10.0 * 0.5 * 0.2, 0, 0, 0, -5.0 * 0.4 * 0.3])
    assert wrench(hydrodynamics.COUPLED_DAMPING, shown, 0.0, 4.0)[5] == pytest.approx(-4.0 * 0.3)
    munk = wrench(hydrodynamics.MUNK_MOMENT, shown, 2.0)
    assert munk[5] == pytest.approx(-(130.0 - 110.0) * 0.4 * 0.3)
    assert munk[4] == pytest.approx(-(110.0 - 140.0) * 0.4 * -0.2)


def test_fouling_grows_from_nothing(course: Made) -> None:
    fouled = course(nu=0.5)
    assert wrench(hydrodynamics.FOULING, fouled, 0.01, at=0) == pytest.approx([0] * 6)
    lasts_s = fouled.time_s[-1] - fouled.time_s[0]
    assert wrench(hydrodynamics.FOULING, fouled, 0.01)[0] == pytest.approx(-0.01 * lasts_s * 50.0 * 0.5)


def test_what_a_refit_takes_up_is_told_as_mass_and_damping(course: Made) -> None:
    still = course()
    since = hydrodynamics.FOULING_SINCE.act(still, np.array([0.1]))
    assert since.damping == pytest.approx(0.1 * still.damping)
    water = rigid_body.ENTRAINED_WATER.act(still, np.array([3.0]))
    assert water.mass == pytest.approx([3, 3, 3, 0, 0, 0])
    payload = rigid_body.ADDED_PAYLOAD.act(still, np.array([7.2]))
    assert payload.mass == pytest.approx([7.2, 7.2, 7.2, 0, 0, 0])
    assert payload.damping == pytest.approx([*(0.1 * still.damping[:3]), 0, 0, 0])


def test_a_payload_on_a_hull_with_quadratic_drag_alone_brakes_too(course: Made) -> None:
    nu = [0.5, -0.4, 0.3, 0.2, 0.2, 0.2]
    square = np.array([40.0, 60.0, 80.0, 3.0, 4.0, 5.0])
    hull = replace(course(nu=nu), damping=np.zeros(6), quadratic=square)
    payload = rigid_body.ADDED_PAYLOAD.act(hull, np.array([7.2]))
    assert payload.quadratic == pytest.approx([4.0, 6.0, 8.0, 0, 0, 0])
    assert payload.wrench[-1] == pytest.approx([-4.0 * 0.25, 6.0 * 0.16, -8.0 * 0.09, 0, 0, 0])


def carried(course: Course, first: np.ndarray) -> np.ndarray:
    """Force that a mass on an arm needs beyond one at the origin, from a point's acceleration."""
    velocity, omega = course.nu[-1, :3], course.nu[-1, 3:]
    rate, turning = course.nu_dot[-1, :3], course.nu_dot[-1, 3:]
    origin = rate + np.cross(omega, velocity)
    force = np.cross(turning, first) + np.cross(omega, np.cross(omega, first))
    return np.concatenate([force, np.cross(first, origin)])


def test_a_mass_off_the_middle_takes_a_point_mass_s_acceleration(rich_course: Course) -> None:
    result = wrench(rigid_body.CG_OFFSET_IN_SPACE, rich_course, 0.03, -0.02)
    assert result == pytest.approx(-carried(rich_course, DRY_KG * np.array([0.03, -0.02, 0.0])))


def test_added_mass_below_the_centre_of_mass_couples_surge_with_pitch_and_sway_with_roll(
    rich_course: Course,
) -> None:
    coupling = np.zeros((6, 6))
    coupling[[0, 4], [4, 0]] = 0.05 * rich_course.added_mass[0]
    coupling[[1, 3], [3, 1]] = -0.05 * rich_course.added_mass[1]
    nu, nu_dot = rich_course.nu[-1], rich_course.nu_dot[-1]
    push, turn = np.split(coupling @ nu, 2)
    coriolis = np.concatenate([np.cross(nu[3:], push), np.cross(nu[3:], turn) + np.cross(nu[:3], push)])
    assert wrench(LOW_WATER, rich_course, 0.05) == pytest.approx(-coupling @ nu_dot - coriolis)


def test_drag_below_the_centre_of_mass_pulls_the_nose_down_and_rolls_with_sway(course: Made) -> None:
    """What it adds to the added mass there is the drag's lever."""
    moving = course(nu=[0.5, 0.2, 0.1, 0.1, 0.2, 0.3], nu_dot=[0.3, 0.2, 0.1, 0, 0, 0])
    lever = wrench(LOW_HULL, moving, 0.05) - wrench(LOW_WATER, moving, 0.05)
    assert lever == pytest.approx([0, 0, 0, 0.05 * 60 * 0.2, -0.05 * 50 * 0.5, 0])


def test_level_and_in_space_are_one_where_nothing_rolls_pitches_or_heaves(course: Made) -> None:
    level = course(nu=[0.5, 0.2, 0, 0, 0, 0.4], nu_dot=[0.1, -0.2, 0, 0, 0, 0.3])
    moments = wrench(rigid_body.CG_OFFSET, level, 0.03, -0.02)
    assert moments == pytest.approx(wrench(rigid_body.CG_OFFSET_IN_SPACE, level, 0.03, -0.02))
    x, y = DRY_KG * 0.03, -DRY_KG * 0.02
    assert moments[0] == pytest.approx(x * 0.16 + y * 0.3)
    assert moments[1] == pytest.approx(-x * 0.3 + y * 0.16)
    assert moments[5] == pytest.approx(-x * (-0.2 + 0.2) + y * (0.1 - 0.2 * 0.4))


def test_a_lower_centre_of_mass_rights_as_the_dynamics_do(course: Made) -> None:
    tilted = course(euler=[0.2, -0.1, 0.7])
    half = np.array([0.2, -0.1, 0.7]) / 2
    (c_r, c_p, c_h), (s_r, s_p, s_h) = np.cos(half), np.sin(half)
    attitude = (
        c_r * c_p * c_h + s_r * s_p * s_h,
        s_r * c_p * c_h - c_r * s_p * s_h,
        c_r * s_p * c_h + s_r * c_p * s_h,
        c_r * c_p * s_h - s_r * s_p * c_h,
    )
    shape = tilted.configuration
    moments = np.array(restoring(shape, attitude)) / shape.centre_of_gravity_below_buoyancy_m
    for effect in (RIGHTING, LOW_MASS):
        assert wrench(effect, tilted, 0.02)[3:] == pytest.approx(-0.02 * moments[3:])
    force = np.array(restoring(shape, attitude))[:3] / shape.net_buoyancy_n
    assert wrench(rigid_body.NET_BUOYANCY, tilted, 3.0)[:3] == pytest.approx(-3.0 * force)


def skew(a: np.ndarray) -> np.ndarray:
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def by_matrix(mass: np.ndarray, nu: np.ndarray) -> np.ndarray:
    """C(nu) nu of a mass matrix (Fossen 2011, eq. 3.46)."""
    momentum = mass @ nu
    upper, lower = skew(momentum[:3]), skew(momentum[3:])
    return np.concatenate([-upper @ nu[3:], -upper @ nu[:3] - lower @ nu[3:]])


@pytest.mark.parametrize("heading", [2.5])
def test_a_model_over_ground_lacks_in_a_current_what_the_equations_through_the_water_say(
    course: Made, heading: float
) -> None:
    nu = np.array([0.5, -0.2, 0.1, 0.0, 0.0, 0.3])
    nu_dot = np.array([0.1, 0.2, -0.1, 0.0, 0.1, -0.2])
    level = course(nu=nu, nu_dot=nu_dot, euler=[0.0, 0.0, heading])
    turning = np.column_stack([np.zeros((len(level.time_s), 2)), heading + 0.3 * level.since_s])
    moving = replace(level, euler=turning)
    rigid = np.diag([72.0, 72.0, 72.0, 3.2, 9.5, 10.5])
    whole = np.diag(moving.mass)
    added, damping = whole - rigid, np.diag(moving.damping)
    water = environment.STEADY_CURRENT.act(moving, np.array([0.1, -0.2])).water
    now = np.concatenate([water[20], np.zeros(3)])
    through = nu - now
    rate = nu_dot + np.concatenate([np.cross(nu[3:], now[:3]), np.zeros(3)])
    over_ground = whole @ nu_dot + by_matrix(whole, nu) + damping @ nu
    in_water = (
        rigid @ nu_dot + by_matrix(rigid, nu) + added @ rate + by_matrix(added, through) + damping @ through
    )
    known = replace(moving, nu=moving.nu - np.column_stack([water, np.zeros((len(water), 3))]), water=water)
    assert known.pushed_by(water)[20] == pytest.approx(over_ground - in_water, abs=1e-3)


def test_a_current_is_what_a_reading_over_ground_has_beyond_the_velocity_through_the_water(
    course: Made,
) -> None:
    east = course(euler=[0, 0, np.pi / 2])
    ahead = environment.STEADY_CURRENT.act(east, np.array([0.0, 0.1]))
    aside = environment.STEADY_CURRENT.act(east, np.array([0.1, 0.0]))
    assert ahead.water[7] == pytest.approx([0.1, 0, 0])
    assert aside.water[7] == pytest.approx([0, -0.1, 0])
    assert ahead.wrench is None
    assert replace(ahead, velocity=ahead.water).beyond[7] == pytest.approx([0.2, 0, 0])


def test_a_current_that_changes_is_told_by_its_amplitude_and_period(course: Made) -> None:
    effect = environment.varying_current(4.0)
    water = effect.act(course(), np.array([0.1, 0, 0, 0])).water
    assert water[0] == pytest.approx([0, 0, 0])
    assert water[20] == pytest.approx([0.1, 0, 0])
    assert effect.answer_parameters(np.array([0.03, 0.0, 0.0, -0.04])) == {
        "amplitude": (pytest.approx(0.05), "m/s"),
        "period": (4.0, "s"),
    }


def test_waves_push_as_the_world_lies_and_die_with_depth(course: Made) -> None:
    effect = environment.waves(4.0)
    depth = np.concatenate([np.full(200, 1.0), np.full(200, 3.0)])
    east = course(euler=[0, 0, np.pi / 2], depth_m=depth)
    number = (2 * np.pi / 4.0) ** 2 / GRAVITY_M_S2
    shallow = wrench(effect, east, 0, 0, 2.0, 0, 0, 1.0, at=20)
    deep = wrench(effect, east, 0, 0, 2.0, 0, 0, 1.0, at=-60)
    assert shallow == pytest.approx([2.0 * np.exp(number), 0, 0, 0, 0, 0], abs=1e-12)
    assert deep == pytest.approx([2.0 * np.exp(-number), 0, 0, 0, 0, 0], abs=1e-12)
    unknown = wrench(effect, course(), 0, 0, 0, 0, 0, 1.5, at=0)
    assert unknown == pytest.approx([0, 0, 1.5, 0, 0, 0])
    parameters = effect.answer_parameters(np.array([3.0, 0, 0, 4.0, 1.0, 0]))
    assert parameters == {"force_amplitude": (pytest.approx(5.0), "N"), "period": (4.0, "s")}


@pytest.mark.parametrize(
    ("period_s", "depth_m", "level_n", "upright_n", "possible"),
    [
        (6.0, 4.0, 20.0, 15.0, True),
        # At 1.7 s the orbits have faded to a five hundredth: no wave that does not break pushes so down there.
        (1.7, 4.4, 2.0, 2.0, False),
        (1.7, 0.5, 2.0, 2.0, True),
        (1.7, np.nan, 2.0, 2.0, True),
        # A pump pushes up and down; orbits are circles or lie flat.
        (6.0, 4.0, 1.0, 15.0, False),
        (6.0, 4.0, 15.0, 1.0, True),
        # Of a dive that reads depth alone nothing says how level the orbits are.
        (6.0, 4.0, 0.0, 15.0, True),
    ],
)
def test_waves_are_no_steeper_than_they_can_be_and_no_more_upright(
    course: Made, period_s: float, depth_m: float, level_n: float, upright_n: float, possible: bool
) -> None:
    effect = environment.waves(period_s)
    assert effect.possible is not None
    assert effect.possible(course(depth_m=depth_m), np.array([level_n, 0, 0, 0, upright_n, 0])) is possible


def test_a_mass_that_a_boundary_adds_has_the_coriolis_force_of_a_mass(course: Made) -> None:
    moving = course(nu=[0.5, 0.2, 0.1, 0.1, -0.2, 0.3], depth_m=0.5)
    mass = moving.mass + 0.2 * np.array([0.25 * 38, 58, 68, 0, 0, 0])
    nominal, whole = (np.array(coriolis(m.tolist(), moving.nu[0])) for m in (moving.mass, mass))
    assert wrench(environment.FREE_SURFACE, moving, 0.2, 0.0) == pytest.approx(nominal - whole)


def test_a_boundary_is_told_by_what_the_masses_weigh_or_else_by_how_they_pull() -> None:
    for effect in environment.SURFACES:
        assert effect.answer_parameters(np.array([0.3, 0.1])) == {"mass_change": (0.3, "1")}
        assert effect.answer_parameters(np.array([0.0, 0.1])) == {"mass_change": (0.1, "1")}


def test_in_a_known_current_the_hull_is_braked_through_the_water_and_read_over_ground(course: Made) -> None:
    values, through = np.array([20.0, 40.0, 60.0, 0.0, 0.0, 0.0]), np.array([0.4, 0.1, 0.05, 0.0, 0.0, 0.0])
    still = course(nu=through)
    known = replace(still, water=environment.STEADY_CURRENT.act(still, np.array([0.1, -0.2])).water)
    drag = hydrodynamics.QUADRATIC_DRAG.act(known, values).wrench
    read = sensors.DVL_SCALE.act(known, np.array([1.1])).velocity
    assert drag[5] == pytest.approx(-values * np.abs(through) * through)
    assert read[5] == pytest.approx([0.1 * 0.5, 0.1 * -0.1, 0.1 * 0.05])
    assert known.over_ground[1][5] == pytest.approx(known.nu_dot[5])


def test_drag_astern_and_drag_that_grows_are_of_the_whole_drag(course: Made) -> None:
    values = np.array([20.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    astern = replace(course(nu=np.array([-0.5, 0.0, 0.0, 0.0, 0.0, 0.0])), quadratic=values)
    whole = astern.damping[0] * 0.5 + 20.0 * 0.25
    assert hydrodynamics.DRAG_ASYMMETRY.act(astern, np.array([1.5])).wrench[5, 0] == pytest.approx(
        0.5 * whole
    )
    late = hydrodynamics.FOULING.act(astern, np.array([1e-3])).wrench[-1, 0]
    assert late == pytest.approx(1e-3 * astern.since_s[-1] * whole)


ONES = np.ones(8)
WEAK = np.array([1.0, 1.0, 0.7, 1.0, 1.0, 1.0, 1.0, 1.0])


def test_the_hull_is_made_up_for_as_its_effects_are_planted(rich_course: Course) -> None:
    course = rich_course
    hull = {"X_uu": 6.0, "Y_vv": 3.0, "N_rr": 0.5, "Y_r": 4.0, "N_v": -3.0, "Y_uv": 20.0, "N_uv": 8.0}
    mass_kg = course.configuration.dry_mass_kg
    hull |= {"S_x": 0.02 * mass_kg, "S_y": -0.01 * mass_kg, "N_munk": 0.3 * (course.mass[1] - course.mass[0])}
    planted: tuple[tuple[Effect, tuple[float, ...]], ...] = (
        (hydrodynamics.QUADRATIC_DRAG, (6.0, 3.0, 0.0, 0.0, 0.0, 0.5)),
        (hydrodynamics.COUPLED_DAMPING, (4.0, -3.0)),
        (hydrodynamics.CROSS_FLOW_LIFT, (20.0, 8.0)),
        (hydrodynamics.MUNK_MOMENT_IN_YAW, (1.3,)),
        (rigid_body.CG_OFFSET, (0.02, -0.01)),
    )
    taken = np.zeros_like(course.nu)
    for effect, values in planted:
        wrench = effect.act(course, np.array(values)).wrench
        taken += wrench
    assert np.abs(taken[:, [0, 1, 5]]).max() > 1.0
    for nu, nu_dot, lost in zip(course.nu, course.nu_dot, taken, strict=True):
        made = np.array(hull_wrench(hull, Reference(tuple(nu), tuple(nu_dot), 0.0, 0.0)))
        np.testing.assert_allclose((made + lost)[[0, 1, 5]], 0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("effect", "values", "losses"),
    [
        (actuators.THRUST_GAIN, 0.8, Losses(0.8 * ONES)),
        (actuators.REVERSE_THRUST_LOSS, 0.7, Losses(ONES, astern=0.7)),
        (actuators.DEAD_ZONE, 2.0, Losses(ONES, least_n=2.0)),
        (actuators.DEAD_ZONE_SHIFTED, 2.0, Losses(ONES, start_n=2.0)),
        (actuators.weak(3), 0.7, Losses(WEAK)),
        (supply.LOAD_SAG, 0.02, Losses(ONES, resistance_ohm=0.02)),
    ],
    ids=lambda given: getattr(given, "label", ""),
)
def test_thrusters_lose_on_board_what_they_lose_in_the_library(
    rich_course: Course, effect: Effect, values: float, losses: Losses
) -> None:
    # So short a lag gives at each instant what was asked for over the step before.
    course = replace(rich_course, lag_s=1e-6)
    wrench = effect.act(course, np.array([values])).wrench
    given = np.array([losses.given(asked) for asked in course.asked_n])
    np.testing.assert_allclose(course.wrench_of(given - course.asked_n)[:-1], wrench[1:], atol=1e-9)


def test_a_sag_of_the_rate_of_the_voltage_is_thrust_that_goes_as_its_square(rich_course: Course) -> None:
    since_s = rich_course.since_s
    voltage_v = 16.0 - 0.1 * since_s
    begun_v, rate = supply.voltage_law(voltage_v, since_s)
    fall = rate * supply.fall_by_voltage(voltage_v, since_s)
    assert begun_v == 16.0
    assert fall[0] == 0.0
    assert fall[-1] == pytest.approx(1 - ((16.0 - 0.1 * since_s[-1]) / 16.0) ** 2, abs=0.15)
    assert np.isnan(supply.voltage_law(np.full_like(since_s, np.nan), since_s)).all()
