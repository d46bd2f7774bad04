"""Thrusters and shafts: one pushing, all pushing, ahead and astern."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bridge.vehicle.config import Configuration, ThrustCurve, Thruster
from bridge.vehicle.thrusters import shaft_speed, thrust_by_shaft
from identify.diagnose.causes.candidates import settings_of
from identify.effects import actuators, supply, wake
from identify.effects.actuators import SATURATION
from identify.effects.course import Course, lagged
from identify.effects.effect import Effect

Made = Callable[..., Course]
AHEAD, ASIDE = 0.82904, 0.55919
SURGE = np.array([1.0, 1, 1, 1, 0, 0, 0, 0])


def pushed(effect: Effect, course: Course, *values: float, at: int = -1) -> np.ndarray:
    """The wrench that it adds at an instant, and by default in the end."""
    result = effect.act(course, np.array(values)).wrench
    return result[at]


def more(effect: Effect, course: Course, *values: float, at: int = -1) -> np.ndarray:
    """Extra force of each thruster by an effect that shaft speeds show."""
    result = effect.act(course, np.array(values)).shaft_n
    return result[at]


def surge(thrust_n: float) -> np.ndarray:
    """The wrench of the four level thrusters with so many newtons each."""
    return np.array([4 * AHEAD * thrust_n, 0, 0, 0, 0, 0])


AHEAD_HALF = {"nu": [0.5, 0, 0, 0, 0, 0]}


@pytest.mark.parametrize(
    ("effect", "asked_n", "motion", "values", "expected"),
    [
        (actuators.THRUST_GAIN, 10 * SURGE, {}, (0.9,), surge(-1.0)),
        # The low end loses and full thrust does not.
        (actuators.THRUST_CURVE, 10 * SURGE, {}, (0.2,), surge(-1.5)),
        (actuators.THRUST_CURVE, 40 * SURGE, {}, (0.2,), surge(0.0)),
        (actuators.THRUST_CURVE, -10 * SURGE, {}, (0.2,), surge(1.5)),
        # Felt astern alone.
        (actuators.REVERSE_THRUST_LOSS, 10 * SURGE, {}, (0.7,), surge(0.0)),
        (actuators.REVERSE_THRUST_LOSS, -10 * SURGE, {}, (0.7,), surge(3.0)),
        # Inflow takes from thrust ahead and adds to thrust astern.
        (wake.INFLOW_LOSS, 9 * SURGE, AHEAD_HALF, (0.5,), surge(-0.5 * 3.0 * 0.5 * AHEAD)),
        (wake.INFLOW_LOSS, -9 * SURGE, AHEAD_HALF, (0.5,), surge(-0.5 * 3.0 * 0.5 * AHEAD)),
        # By the current of all thrusters; and a supply never turns thrust round.
        (supply.LOAD_SAG, 25 * SURGE, {}, (0.05,), surge(-25 * (1 - (1 - 0.05 * 4 * 0.062 * 125 / 16.0) ** 2))),
        (supply.LOAD_SAG, 40 * SURGE, {}, (2.0,), surge(-40)),
        # Reaction torques go with total thrust.
        (wake.PROPELLER_TORQUE, 10.0, {}, (0.01, 0.02), [0, 0, 0, 0.01 * 40 * AHEAD, 0, 0.02 * 40]),
    ],
    ids=lambda given: getattr(given, "label", ""),
)  # fmt: skip
def test_an_effect_gives_and_takes_thrust_as_its_law_says(
    course: Made,
    effect: Effect,
    asked_n: Any,
    motion: dict[str, Any],
    values: tuple[float, ...],
    expected: Any,
) -> None:
    assert pushed(effect, course(asked_n=asked_n, **motion), *values) == pytest.approx(expected)


def test_a_dead_zone_swallows_what_is_below_it_and_one_kind_takes_from_all_above(course: Made) -> None:
    asked = course(asked_n=[0.3, -0.3, 5.0, -5.0, 0, 0, 0, 0])
    assert more(actuators.DEAD_ZONE, asked, 0.5) == pytest.approx([-0.3, 0.3, 0, 0, 0, 0, 0, 0])
    shifted = more(actuators.DEAD_ZONE_SHIFTED, asked, 0.5)
    assert shifted == pytest.approx([-0.3, 0.3, -0.5, 0.5, 0, 0, 0, 0])


def stepping(course: Made) -> Course:
    asked = np.zeros((400, 8))
    asked[200:] = 10 * SURGE
    return course(asked_n=asked)


def test_a_longer_lag_lacks_what_has_not_come_yet(course: Made) -> None:
    effect, _ = actuators.thruster_lag(0.05)
    for steps in (0, 1, 5):
        expected = 10 * (np.exp(-steps * 0.05 / 0.05) - np.exp(-steps * 0.05 / 0.2))
        assert more(effect, stepping(course), 0.2, at=200 + steps) == pytest.approx(expected * SURGE)


@pytest.mark.parametrize(
    ("lag_s", "stages_s"), [(0.04, (0.04, 0.0)), (0.09, (0.05, 0.04)), (0.4, (0.2, 0.2))], ids=str
)
def test_a_lag_in_two_stages_begins_as_the_nominal_lag_and_ends_in_equal_halves(
    course: Made, lag_s: float, stages_s: tuple[float, float]
) -> None:
    _, effect = actuators.thruster_lag(0.05)
    stepped = replace(stepping(course), time_s=0.02 * np.arange(400))
    first, second = stages_s
    # In steps so short that it hardly matters what the second stage sees within one.
    finely = lagged(lagged(np.repeat(stepped.asked_n, 200, axis=0), 1e-4, first), 1e-4, second)[::200]
    given = finely - stepped.thrust_n
    for steps in (0, 1, 5):
        expected = given[200 + steps, 0] * SURGE
        assert more(effect, stepped, lag_s, at=200 + steps) == pytest.approx(expected, abs=0.1)


def test_a_delay_lacks_the_whole_step_until_it_is_over(course: Made) -> None:
    sharp = replace(stepping(course), lag_s=0.0)
    # At the instants of the demand's step and of the thrust's, thrust is midway between before and after.
    for steps, lacking in ((-1, 0.0), (0, -5.0), (1, -10.0), (2, -5.0), (3, 0.0)):
        result = more(actuators.COMMAND_DELAY, sharp, 0.1, at=200 + steps)
        assert result == pytest.approx(lacking * SURGE, abs=1e-9)


def test_a_battery_sags_with_time_or_as_its_voltage_squared(course: Made) -> None:
    fading = course(asked_n=10 * SURGE, voltage_v=16.0 * np.sqrt(1 - 1e-3 * 0.05 * np.arange(400)), count=400)
    lasts_s = fading.time_s[-1] - fading.time_s[0]
    assert pushed(supply.BATTERY_SAG, fading, 1e-3) == pytest.approx(surge(-1e-2 * lasts_s))
    long = course(asked_n=10 * SURGE, voltage_v=16.0 * np.sqrt(1 - 1e-3 * 0.05 * np.arange(8000)), count=8000)
    by_voltage = pushed(supply.BATTERY_SAG_BY_VOLTAGE, long, 1e-3, at=-1) - pushed(
        supply.BATTERY_SAG_BY_VOLTAGE, long, 1e-3, at=4000
    )
    assert by_voltage == pytest.approx(surge(-1e-2 * 3999 * 0.05), rel=0.03)


def test_the_rate_by_voltage_is_the_mean_rate_at_which_thrust_falls() -> None:
    since_s = 0.05 * np.arange(8000)
    voltage_v = 16.0 - 1.5 * (since_s / since_s[-1]) ** 2
    fall_s = supply.fall_by_voltage(voltage_v, since_s)
    assert np.polyfit(since_s, fall_s, 1)[0] == pytest.approx(1.0)
    assert fall_s[0] == 0.0
    assert fall_s[-1] > 1.5 * since_s[-1] / 2


@pytest.mark.parametrize("voltage_v", [np.nan, 15.5, np.linspace(15.0, 16.0, 400)])
def test_a_voltage_that_is_not_known_or_does_not_fall_drives_nothing(course: Made, voltage_v: object) -> None:
    still = course(asked_n=10 * SURGE, voltage_v=voltage_v)
    assert not np.any(pushed(supply.BATTERY_SAG_BY_VOLTAGE, still, 1e-3))


def test_a_voltage_with_holes_is_drawn_through_them() -> None:
    since_s = 0.05 * np.arange(4000)
    whole = 16.0 - 0.005 * since_s
    holes = np.where(np.arange(4000) % 3 == 0, whole, np.nan)
    assert supply.fall_by_voltage(holes, since_s) == pytest.approx(
        supply.fall_by_voltage(whole, since_s), abs=0.1
    )


def test_inflow_is_that_of_the_thrusters_own_place(course: Made) -> None:
    spinning = course(nu=[0, 0, 0, 0, 0, 1.0])
    expected = []
    for thruster in spinning.configuration.thrusters:
        at = np.cross([0, 0, 1.0], thruster.position_m)
        expected.append(at @ thruster.direction)
    assert wake.inflow_m_s(spinning)[0] == pytest.approx(expected)


def test_wash_meets_the_hull_of_fore_thrusters_pushing_ahead_and_of_aft_ones_pushing_astern(
    course: Made,
) -> None:
    for thrust, lossy in ((10.0, [0, 1]), (-10.0, [2, 3])):
        both = course(asked_n=thrust * np.ones(8))
        lost = np.zeros(8)
        lost[lossy] = -0.1 * thrust
        assert pushed(wake.HULL_INTERACTION, both, 0.1) == pytest.approx(both.wrench_of(lost))


def test_a_thruster_loses_in_the_wash_of_the_one_before_it(course: Made) -> None:
    first = np.array([10.0, 0, 4.0, 4.0, 0, 0, 0, 0])
    for thrust, lost in ((first, [0, 0, -0.4, 0, 0, 0, 0, 0]), (-first, [1.0, 0, 0, 0, 0, 0, 0, 0])):
        at = course(asked_n=thrust)
        # Astern, the wash of thruster 3 goes ahead to thruster 1, and that of 4 would go to 2, which rests.
        assert pushed(wake.THRUSTER_INTERACTION, at, 0.1) == pytest.approx(
            at.wrench_of(np.array(lost, dtype=float))
        )


def test_the_reaction_of_a_propeller_is_about_its_own_axis(course: Made) -> None:
    unpowered = course(asked_n=0.0)
    aside = np.sign(np.round(unpowered.allocation[1], 9))
    sway = course(asked_n=10 * aside)
    pushes = sway.wrench_of(10 * aside)[:3]
    assert abs(pushes[1]) > 1.0
    assert pushed(wake.PROPELLER_TORQUE, sway, 0.01, 0.02)[3:] == pytest.approx(
        [0, 0.01 * pushes[1], 0], abs=1e-9
    )


def test_one_weak_thruster_lacks_a_share_of_its_own_wrench(course: Made) -> None:
    pushing = course(asked_n=10 * SURGE)
    lever = 0.42 * ASIDE - (-0.32) * AHEAD
    expected = [-2 * AHEAD, -2 * ASIDE, 0, 0, 0, -2 * lever]
    assert pushed(actuators.weak(1), pushing, 0.8) == pytest.approx(expected)
    assert actuators.weak(3).answer_parameters(np.array([0.8])) == {
        "thruster": (3.0, "1"),
        "gain": (0.8, "1"),
    }


@pytest.fixture
def pusher() -> Configuration:
    thrusters = (
        Thruster((1.0, 0.0, 0.0), (-0.5, 0.1, 0.0), gain=0.5),
        Thruster((0.0, 0.0, 1.0), (0.2, 0.0, 0.0)),
    )
    return Configuration(dry_mass_kg=10.0, inertia_kgm2=(1.0, 1.0, 1.0), thrusters=thrusters)


def test_a_turned_thruster_pushes_elsewhere(course: Made, pusher: Configuration) -> None:
    at = course(asked_n=[10.0, 0.0], configuration=pusher)
    cos, sin = np.cos(0.2), np.sin(0.2)
    expected = np.array([5 * (cos - 1), 5 * sin, 0, 0, 0, -0.5 * 5 * sin - 0.1 * 5 * (cos - 1)])
    assert pushed(actuators.turned(1, "z"), at, 0.2) == pytest.approx(expected)
    up = course(asked_n=[0.0, 10.0], configuration=pusher)
    assert pushed(actuators.turned(2, "x"), up, 0.2)[:3] == pytest.approx([0, -10 * sin, 10 * (cos - 1)])
    assert pushed(actuators.turned(2, "y"), up, 0.2)[:3] == pytest.approx([10 * sin, 0, 10 * (cos - 1)])


def test_a_thruster_that_sits_elsewhere_turns_the_body_and_pushes_no_harder(
    course: Made, pusher: Configuration
) -> None:
    level, upright = (actuators.shifted(k + 1, t) for k, t in enumerate(pusher.thrusters))
    at = course(asked_n=[10.0, 10.0], configuration=pusher)
    assert pushed(level, at, 0.02) == pytest.approx([0, 0, 0, 0, 0, -0.02 * 5])
    assert pushed(upright, at, 0.02, 0.03) == pytest.approx([0, 0, 0, 0.3, -0.2, 0])
    assert upright.answer_parameters(np.array([0.02, 0.03])) == {"thruster": (2.0, "1")}


CURVE = ThrustCurve()


def test_thrust_comes_back_from_its_shaft_speed() -> None:
    thrust = np.array([[-30.0, -0.1, 0.0, 0.1, 45.0]])
    assert thrust_by_shaft(CURVE, 60 * shaft_speed(CURVE, thrust)) == pytest.approx(thrust)


def test_shafts_show_what_a_saturation_takes_and_nothing_where_they_are_not_recorded(
    course: Callable[..., Course],
) -> None:
    asked = course(asked_n=[30.0, -30.0, 5.0, 0, 0, 0, 0, 0])
    act = SATURATION.act(asked, np.array([12.0]))
    assert act.shaft_n[-1] == pytest.approx([-18, 18, 0, 0, 0, 0, 0, 0])
    rpm = 60 * shaft_speed(CURVE, asked.thrust_n + act.shaft_n)
    rpm[:, 7] = np.nan
    seen = thrust_by_shaft(CURVE, rpm) - asked.thrust_n
    assert seen[:, :7] == pytest.approx(act.shaft_n[:, :7])
    assert np.isnan(seen[:, 7]).all()


def test_thrusters_that_give_next_to_nothing_are_not_limited(rich_course: Course) -> None:
    """With masses and drags of next to nothing, no thrust fits any motion."""
    most_n = float(np.abs(rich_course.asked_n).max())
    assert SATURATION.possible is not None
    allowed = [
        SATURATION.possible(rich_course, np.array([share * most_n])) for share in (0.0, 0.05, 0.15, 0.9)
    ]
    assert allowed == [False, False, True, True]


def test_a_limit_is_tried_at_shares_of_the_most_that_was_asked(rich_course: Course) -> None:
    """A pilot who asks for 1 N of thrusters of 35 N still finds a limit of half of that."""
    gentle = replace(rich_course, asked_n=rich_course.asked_n / np.abs(rich_course.asked_n).max())
    settings, causes = settings_of((SATURATION,), gentle)
    limits = [float(setting.steps[0, 0]) for setting in settings]
    assert limits == pytest.approx([1 / 1.5, 1 / 2, 1 / 3, 1 / 5])
    assert all(np.any(cause.act(gentle).wrench) for cause in causes)
