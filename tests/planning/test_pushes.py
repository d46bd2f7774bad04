"""Legs that push: a force held open loop, as a pilot's stick does."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bridge.errors import ConfigError
from bridge.navigation import Navigation
from bridge.simulator.direct import QUIET, simulate_truth
from bridge.simulator.missions import Leg, Mission, load_mission, rest
from bridge.simulator.truth import load_truth
from bridge.vehicle.autopilot import HOLD_AFTER_S, Autopilot
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.feedforward import Mode
from bridge.vehicle.references import Reference

FILE = load_vehicle("ruvifist:hovering")
STILL = (0.0,) * 6
PUSHED = Reference(
    (0.0, 0.2, 0, 0, 0, 0), (0.0, 0.1, 0, 0, 0, 0), 0.0, 0.6, (24.0, None, None, None, None, 0.0)
)
MOVING = Navigation(
    velocity=(0.3, 0.0, 0.0),
    velocity_time_s=0.0,
    rate=(0.0, 0.0, 0.1),
    rate_time_s=0.0,
    attitude=(1.0, 0.0, 0.0, 0.0),
    attitude_time_s=0.0,
    heading_rad=0.2,
    depth_m=0.6,
    depth_time_s=0.0,
)


def pilot(mode: Mode) -> Autopilot:
    model = {"M_u": 111.6, "D_u": 56.2, "M_v": 112.4, "D_v": 53.1, "I_r": 16.0, "D_r": 26.1}
    return Autopilot(FILE.vehicle, "hovering", lambda _: model, FILE.path.parent, mode)


@pytest.mark.parametrize("mode", list(Mode))
def test_the_thrusters_give_a_push_itself_in_every_mode(mode: Mode) -> None:
    told = pilot(mode).step(0.0, MOVING, PUSHED)
    assert told.tau_cmd[0] == pytest.approx(24.0)
    assert told.tau_cmd[5] == pytest.approx(0.0, abs=1e-9)
    assert told.tau_pid[0] == told.tau_pid[5] == 0.0


def test_the_axes_that_are_not_pushed_keep_their_controller() -> None:
    alone = pilot(Mode.OFF).step(0.0, MOVING, replace(PUSHED, push=(None,) * 6))
    pushed = pilot(Mode.OFF).step(0.0, MOVING, PUSHED)
    assert pushed.tau_pid[1] == alone.tau_pid[1] != 0.0


def test_a_push_begins_the_loop_anew_afterwards() -> None:
    fresh, used = pilot(Mode.OFF), pilot(Mode.OFF)
    hold = replace(PUSHED, push=(None,) * 6)
    for tick in range(10):
        used.step(0.05 * tick, MOVING, hold)
    used.step(0.5, replace(MOVING, velocity_time_s=0.5, rate_time_s=0.5, attitude_time_s=0.5), PUSHED)
    late = replace(MOVING, velocity_time_s=0.55, rate_time_s=0.55, attitude_time_s=0.55)
    fresh.step(0.5, late, PUSHED)
    assert used.step(0.55, late, hold).tau_pid[0] == fresh.step(0.55, late, hold).tau_pid[0]


def test_a_vehicle_that_lost_its_velocity_is_pushed_no_more() -> None:
    autopilot = pilot(Mode.OFF)
    autopilot.step(0.0, MOVING, PUSHED)
    told = autopilot.step(HOLD_AFTER_S + 0.1, MOVING, PUSHED)
    assert told.tau_cmd[0] == pytest.approx(0.0, abs=1e-9)


def test_a_pushed_body_ends_at_force_over_damping_and_then_coasts() -> None:
    truth = load_truth(FILE, "hovering").calm()
    legs = (
        Leg("ahead", "steady", 20.0, push_surge_n=20.0),
        Leg("coast", "deceleration", 4.0, push_surge_n=0.0),
    )
    run = simulate_truth(FILE, "hovering", Mission("push", legs), seed=1, noise=QUIET, truth=truth)
    steady = 20.0 / truth.damping[0]
    assert run.nu[399, 0] == pytest.approx(steady, rel=1e-3)
    # The thrusters' lag is dead time in all but name: thrust dies out with it.
    coasted = steady * math.exp(
        -(4.0 - 0.05 - FILE.vehicle.thrust_curve.lag_s) * truth.damping[0] / truth.mass[0]
    )
    assert run.nu[-1, 0] == pytest.approx(coasted, rel=2e-3)
    assert np.all(run.column("tau_pid")[:, 0] == 0.0)


def test_a_leg_of_a_file_may_push_and_alternate(tmp_path: Path) -> None:
    path = tmp_path / "square.yaml"
    path.write_text(
        "name: square\nlegs:\n  - {duration_s: 5, phase: rest}\n"
        "  - {duration_s: 2, push_surge_n: 24, push_sway_n: 0, alternate: 3}\n"
    )
    mission = load_mission(path)
    assert [leg.push_surge_n for leg in mission.legs] == [None, 24.0, -24.0, 24.0]
    assert mission.reference(6.0).push == (24.0, 0.0, None, None, None, None)
    assert mission.reference(4.0).push == (None,) * 6


def test_an_axis_is_not_pushed_and_led_at_once(tmp_path: Path) -> None:
    path = tmp_path / "both.yaml"
    path.write_text("name: both\nlegs:\n  - {name: odd, duration_s: 5, push_surge_n: 3, surge_m_s: 0.3}\n")
    with pytest.raises(ConfigError, match="pushed or has a velocity to keep, not both"):
        load_mission(path)


def test_a_mission_without_pushes_has_none() -> None:
    assert Mission("rest", tuple(rest("still", 2.0))).reference(1.0).push == (None,) * 6
