"""The limit file, and a vehicle's place and transit."""

import math
import re
from dataclasses import astuple, replace
from pathlib import Path

import pytest
from ideal import LIMITS, TICK_S, Ideal

from bridge.errors import ConfigError
from bridge.flight.limits import limits_of, load_limits
from bridge.flight.pose import Pose, dead_reckoned, tilt_rad
from bridge.flight.transit import Transit
from bridge.vehicle.navigation import Navigation

FILE = (
    "shallowest_m: 0.3\ndeepest_m: 4\naltitude_m: 1\ndistance_m: 4\nspeed_m_s: 0.8\ntilt_deg: 25\nbattery_v: 13\n"
    "time_s: 900\n"
)


def test_a_limit_file_has_each_limit_and_defaults_for_link_hold_and_travel(tmp_path):
    path = tmp_path / "limits.yaml"
    path.write_text(FILE)
    assert load_limits(path) == LIMITS
    assert (LIMITS.link_s, LIMITS.hold_s, LIMITS.travel_m_s) == (3.0, 60.0, 0.2)


def test_the_limit_file_that_the_page_shows_is_one(tmp_path):
    page = Path(__file__).resolve().parents[2] / "docs" / "howto" / "fly_a_plan.md"
    (block,) = re.findall(r"```yaml\n(.*?)```", page.read_text(encoding="utf-8"), re.S)
    path = tmp_path / "limits.yaml"
    path.write_text(block, encoding="utf-8")
    assert load_limits(path) == LIMITS


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("shallowest_m: -0.1", "shallowest_m is -0.1; give a depth from 0 to less than deepest_m, 4"),
        ("shallowest_m: 4", "shallowest_m is 4; give a depth from 0 to less than deepest_m, 4"),
        ("deepest_m: 0", "deepest_m is 0; give a value above 0, up to 6000"),
        ("altitude_m: -1", "altitude_m is -1; give a value from 0, for none, up to 100"),
        ("distance_m: 0", "distance_m is 0; give a value above 0, up to 200"),
        ("speed_m_s: 50", "speed_m_s is 50; give a value above 0, up to 3"),
        ("tilt_deg: 90", "tilt_deg is 90; give a value above 0, up to 60"),
        ("battery_v: -2", "battery_v is -2; give a value from 0, for none, up to 1000"),
        ("time_s: .inf", "time_s: inf is not a finite number"),
        ("time_s: 1e999", "time_s: inf is not a finite number"),
        ("time_s: long", "time_s: expected a number, found 'long'"),
        ("link_s: 30", "link_s is 30; give a value above 0, up to 10"),
        ("hold_s: 0", "hold_s is 0; give a value above 0, up to 600"),
        ("travel_m_s: 0.9", "travel_m_s is 0.9, more than speed_m_s, 0.8"),
        ("depht_m: 3", "unknown key 'depht_m'"),
    ],
)
def test_each_bad_limit_is_named_with_what_to_give(tmp_path, line, words):
    key = line.partition(":")[0]
    path = tmp_path / "limits.yaml"
    path.write_text("".join(row for row in FILE.splitlines(True) if not row.startswith(key)) + line + "\n")
    with pytest.raises(ConfigError) as refusal:
        load_limits(path)
    assert str(path) in str(refusal.value)
    assert words in str(refusal.value)


@pytest.mark.parametrize("name", [row.partition(":")[0] for row in FILE.splitlines()])
def test_a_limit_that_is_missing_is_asked_for(tmp_path, name):
    path = tmp_path / "limits.yaml"
    path.write_text("".join(row for row in FILE.splitlines(True) if not row.startswith(name)))
    with pytest.raises(ConfigError, match=f"the key '{name}' is missing"):
        load_limits(path)


def test_where_there_is_no_limit_file_it_says_what_one_looks_like(tmp_path):
    with pytest.raises(ConfigError, match=r"limits\.yaml: no such file; .* docs/howto/fly_a_plan\.md"):
        load_limits(tmp_path / "limits.yaml")


def test_the_vehicle_takes_the_limits_as_numbers_and_refuses_what_are_none():
    good = astuple(LIMITS)
    assert limits_of(good) == LIMITS
    for numbers in ((), good[:5], (*good, 1.0), (math.nan, *good[1:])):
        with pytest.raises(ConfigError):
            limits_of(numbers)


def navigation(velocity, heading_rad, roll_rad=0.0):
    h, r = heading_rad / 2, roll_rad / 2
    attitude = (
        math.cos(h) * math.cos(r),
        math.cos(h) * math.sin(r),
        math.sin(h) * math.sin(r),
        math.sin(h) * math.cos(r),
    )
    return Navigation(velocity, attitude=attitude, heading_rad=heading_rad, depth_m=2.0)


@pytest.mark.parametrize(
    ("velocity", "heading_deg", "north", "east"),
    [
        ((1.0, 0.0, 0.0), 0, 1, 0),
        ((1.0, 0.0, 0.0), 90, 0, 1),
        ((0.0, 1.0, 0.0), 90, -1, 0),
        ((0.0, 0.0, 5.0), 30, 0, 0),
    ],
)
def test_the_place_is_reckoned_from_velocity_and_attitude(velocity, heading_deg, north, east):
    here = dead_reckoned(Pose(0.5, 0.25, 0.0, 0.0), navigation(velocity, math.radians(heading_deg)), 1.0)
    assert (here.north_m, here.east_m) == pytest.approx((0.5 + north, 0.25 + east))
    assert (here.depth_m, here.heading_rad) == (2.0, math.radians(heading_deg))


def test_a_rolled_vehicle_that_sinks_along_its_own_axis_moves_aside():
    here = dead_reckoned(Pose(0.0, 0.0, 0.0, 0.0), navigation((0.0, 0.0, 1.0), 0.0, math.radians(30)), 1.0)
    assert (here.north_m, here.east_m) == pytest.approx((0.0, -0.5))


def test_an_unknown_velocity_moves_nothing_and_an_unknown_depth_stays():
    here = Pose(1.0, 2.0, 3.0, 0.5)
    assert dead_reckoned(here, Navigation(), 1.0) == here


def test_a_velocity_that_no_flight_has_moves_nothing():
    """A DVL's one bad reading counts for up to a second: the way back would lead as many metres astray."""
    fast = replace(Navigation(), velocity=(19.0, 0.0, 0.0), attitude=(1.0, 0.0, 0.0, 0.0))
    assert dead_reckoned(Pose(1.0, 2.0, 1.0, 0.0), fast, 0.5).north_m == 1.0
    slow = replace(fast, velocity=(2.9, 0.0, 0.0))
    assert dead_reckoned(Pose(1.0, 2.0, 1.0, 0.0), slow, 0.5).north_m == pytest.approx(2.45)


@pytest.mark.parametrize("tilt_deg", [0.0, 20.0, 90.0, 170.0])
def test_tilt_is_the_angle_from_the_vertical_whatever_the_heading(tilt_deg):
    assert math.degrees(tilt_rad(navigation((0, 0, 0), 1.2, math.radians(tilt_deg)))) == pytest.approx(
        tilt_deg, abs=1e-5
    )
    assert math.isnan(tilt_rad(Navigation()))


@pytest.mark.parametrize("sways", [True, False])
@pytest.mark.parametrize("place", [(0.0, 0.0), (3.0, 0.0), (-2.0, 1.0), (0.0, -2.5)])
def test_a_transit_leads_to_its_target_without_a_jump_and_within_its_speed(place, sways):
    vehicle = Ideal()
    target = Pose(*place, 2.5, -1.0)
    transit = Transit(Pose(0.0, 0.0, 1.5, 0.5), target, 0.3, sways=sways)
    here, before = Pose(0.0, 0.0, 1.5, 0.5), (0.0,) * 6
    for _ in range(round(90.0 / TICK_S)):
        reference = transit.step(here, TICK_S)
        u, v = reference.nu[:2]
        assert math.hypot(u, v) <= 0.3 + 1e-9
        assert max(abs(u - before[0]), abs(v - before[1])) <= 0.08 * TICK_S + 1e-9
        assert sways or v == 0.0
        before = reference.nu
        vehicle.velocity, vehicle.heading_rad, vehicle.depth_m = (
            (u, v, 0.0),
            reference.heading_rad,
            reference.depth_m,
        )
        here = dead_reckoned(here, vehicle.inputs().navigation, TICK_S)
    assert transit.arrived(here, math.hypot(*before[:2]))
    assert here.distance_m(target) < (0.05 if sways else 0.9)
    assert not transit.arrived(here, 0.2)
    assert not transit.arrived(replace(here, depth_m=2.8), 0.0)
