import math
from pathlib import Path

import pytest
import yaml

from bridge.errors import ConfigError
from bridge.navigation import Navigation
from bridge.vehicle.config import Configuration, Thruster
from bridge.vehicle.controller import GAINS, Controller, Gains, GainTable, load_gains, roll_pitch
from bridge.vehicle.references import Reference

BODY = Configuration(10.0, (1.0, 2.0, 4.0), (Thruster((1.0, 0.0, 0.0), (0.0, 0.0, 0.0)),))
P = Gains((1.0, 2.0), (0.0, 0.0), (0.5, 0.5))
PI = Gains((1.0, 1.0), (0.5, 0.5), (0.0, 0.0))
PROPORTIONAL = GainTable((0.0, 1.0), P, P, P, P, P, P)
INTEGRAL = GainTable((0.0, 1.0), PI, PI, PI, PI, PI, PI)
REACH = (40.0,) * 6
LEVEL = Navigation(
    velocity=(0.0, 0.0, 0.0),
    rate=(0.0, 0.0, 0.0),
    attitude=(1.0, 0.0, 0.0, 0.0),
    heading_rad=0.0,
    depth_m=0.0,
)


def wanted(u: float = 0.0, depth: float = 0.0, heading: float = 0.0) -> Reference:
    return Reference((u, 0, 0, 0, 0, 0), (0.0,) * 6, heading, depth)


def test_gains_are_per_unit_of_mass_and_run_over_the_reference_speed() -> None:
    controller = Controller(PROPORTIONAL, BODY, REACH)
    assert controller.step(LEVEL, wanted(u=0.5), 0.05, False)[0] == pytest.approx(10.0 * 1.5 * 0.5)
    assert controller.step(LEVEL, wanted(u=1.5), 0.05, False)[0] == pytest.approx(10.0 * 2.0 * 1.5)


def test_a_velocity_gain_stiffens_surge_and_sway_alone() -> None:
    moving = Navigation((0.0, 0.0, 0.1), 0, (0.0, 0.0, 0.2), 0, (1.0, 0, 0, 0), 0.1, 0, 0.5, 0)
    ask = Reference((0.3, 0.2, 0, 0, 0, 0), (0.0,) * 6, 0.4, 0.6)
    once, twice = (Controller(INTEGRAL, BODY, REACH).step(moving, ask, 0.05, False, gain) for gain in (1, 2))
    assert twice[:2] == pytest.approx((2 * once[0], 2 * once[1]))
    assert twice[2:] == once[2:]


def test_yaw_acts_on_heading_and_its_rate_and_heave_on_depth_and_its_rate() -> None:
    moving = Navigation((0.0, 0.0, 0.1), 0, (0.0, 0.0, 0.2), 0, (1.0, 0, 0, 0), 6.5, 0, 0.5, 0)
    tau = Controller(PROPORTIONAL, BODY, REACH).step(moving, wanted(depth=0.6, heading=7.0), 0.05, False)
    assert tau[5] == pytest.approx(4.0 * (0.5 - 0.5 * 0.2))
    assert tau[2] == pytest.approx(10.0 * (0.1 - 0.5 * 0.1))


@pytest.mark.parametrize("heading", [math.pi - 0.1 - math.tau, math.pi - 0.1, math.pi - 0.1 + 3 * math.tau])
def test_a_heading_is_reached_by_the_shorter_way(heading: float) -> None:
    there = Navigation((0.0, 0, 0), 0, (0.0, 0, 0), 0, (1.0, 0, 0, 0), heading, 0, 0.0, 0)
    tau = Controller(PROPORTIONAL, BODY, REACH).step(there, wanted(heading=0.1 - math.pi), 0.05, False)
    assert tau[5] == pytest.approx(4.0 * 0.2)


def test_roll_and_pitch_are_pushed_level_and_damped() -> None:
    half = 0.1 / 2
    rolled = Navigation(
        (0.0, 0, 0), 0, (0.3, 0.0, 0.0), 0, (math.cos(half), math.sin(half), 0, 0), 0, 0, 0, 0
    )
    assert Controller(PROPORTIONAL, BODY, REACH).step(rolled, wanted(), 0.05, False)[3] == pytest.approx(
        -0.1 - 0.15
    )
    assert roll_pitch((math.cos(half), 0.0, math.sin(half), 0.0)) == pytest.approx((0.0, 0.1))


def test_the_integral_is_error_times_time() -> None:
    controller = Controller(INTEGRAL, BODY, REACH)
    for _ in range(20):
        tau = controller.step(LEVEL, wanted(u=0.1), 0.05, False)
    assert tau[0] == pytest.approx(10.0 * (0.1 + 0.5 * 0.1 * 1.0))


def test_the_integral_does_not_grow_while_the_thrusters_are_saturated_but_may_shrink() -> None:
    controller = Controller(INTEGRAL, BODY, REACH)
    controller.step(LEVEL, wanted(u=0.1), 1.0, False)
    assert controller.step(LEVEL, wanted(u=0.1), 1.0, True)[0] == pytest.approx(1.0 + 0.5)
    assert controller.step(LEVEL, wanted(u=-0.05), 1.0, True)[0] == pytest.approx(-0.5 + 0.25)


def test_the_output_and_the_integral_stay_within_reach() -> None:
    controller = Controller(INTEGRAL, BODY, REACH)
    for _ in range(100):
        assert controller.step(LEVEL, wanted(u=3.0), 1.0, False)[0] <= 40.0
    assert controller.step(LEVEL, wanted(), 1.0, False)[0] <= 20.0


def test_an_axis_without_a_measurement_gets_nothing() -> None:
    tau = Controller(PROPORTIONAL, BODY, REACH).step(Navigation(), wanted(u=1.0, depth=1.0), 0.05, False)
    assert tau == (0.0,) * 6


def test_depth_is_held_without_a_velocity() -> None:
    tau = Controller(PROPORTIONAL, BODY, REACH).step(Navigation(depth_m=0.5), wanted(depth=0.6), 0.05, False)
    assert tau == pytest.approx((0.0, 0.0, 10.0 * 0.1, 0.0, 0.0, 0.0))


def test_a_reset_forgets_only_the_integrals_named() -> None:
    controller = Controller(INTEGRAL, BODY, REACH)
    ask = Reference((0.1, 0.1, 0, 0, 0, 0), (0.0,) * 6, 0.0, 0.0)
    controller.step(LEVEL, ask, 1.0, False)
    controller.reset((0,))
    tau = controller.step(LEVEL, ask, 1.0, False)
    assert tau[:2] == pytest.approx((1.5, 2.0))


@pytest.mark.parametrize("name", list(yaml.safe_load(GAINS.read_text())))
def test_every_shipped_gain_table_can_be_loaded(name: str) -> None:
    assert load_gains(name).surge.kp[0] > 0


def test_an_unknown_gain_table_is_refused_with_the_names_there_are() -> None:
    with pytest.raises(ConfigError, match="survey, hovering, conservative"):
        load_gains("brisk")


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"speeds_m_s": [1.0, 0.0]}, "must rise"),
        ({"fed": {"gain": 0.0}}, "gain must be above 0"),
        ({"fed": {"straight_below_n": -1.0}}, "straight_below_n not negative"),
        ({"yaw": {"kp": [1.0], "ki": [0.0, 0.0], "kd": [0.0, 0.0]}}, "yaw"),
        ({"yaw": {"kp": [1.0, -1.0], "ki": [0.0, 0.0], "kd": [0.0, 0.0]}}, "none negative"),
    ],
)
def test_a_malformed_gain_table_is_refused(tmp_path: Path, change: dict[str, object], says: str) -> None:
    table = yaml.safe_load(GAINS.read_text())["conservative"] | change
    (tmp_path / "gains.yaml").write_text(yaml.safe_dump({"mine": table}))
    with pytest.raises(ConfigError, match=says):
        load_gains("mine", tmp_path / "gains.yaml")
