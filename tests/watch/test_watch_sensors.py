"""Rows of sensors: fresh or not, what is bad about each, and for how long."""

import math

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav
from vehicle_on_air import LEVEL, NO_LOCK, STILL, OnAir, dvl, imu

from bridge.vehicle.config import load_vehicle
from gcs_plugin.watch.picture import Condition, Freshness, freshness
from gcs_plugin.watch.watcher import Watcher


@pytest.fixture
def watcher():
    return Watcher(load_vehicle("ruvifist"))


@pytest.fixture
def vehicle(watcher):
    on_air = OnAir(watcher)
    on_air.beats(0.0)
    return on_air


def row(watcher, signal, now_s):
    (found,) = [row for row in watcher.picture(now_s).sensors if row.signal == signal]
    return found


def test_a_value_is_stale_after_three_periods_and_gone_after_ten():
    assert freshness(0.59, 5.0) is Freshness.FRESH
    assert freshness(0.61, 5.0) is Freshness.STALE
    assert freshness(2.01, 5.0) is Freshness.GONE
    assert freshness(math.inf, 5.0) is Freshness.GONE


def test_quick_signals_are_allowed_the_pauses_of_a_link_that_batches():
    assert freshness(0.25, 50.0) is Freshness.FRESH


@pytest.mark.usefixtures("vehicle")
def test_a_sensor_of_the_file_that_was_never_heard_is_missing(watcher):
    found = row(watcher, "fog", 5.0)
    assert found.condition is Condition.MISSING
    assert found.age_s == math.inf
    assert found.words == "never heard; check the device and its port"


def test_without_a_file_only_what_was_heard_has_a_row():
    watcher = Watcher(None)
    vehicle = OnAir(watcher)
    vehicle.beats(0.0)
    vehicle.tells("imu", imu(), 0.1)
    assert [row.signal for row in watcher.picture(0.2).sensors] == ["imu"]


def test_no_bottom_lock_is_bad_and_counted_since_the_last_velocity(watcher, vehicle):
    for k in range(40):
        vehicle.tells("dvl", dvl() if k < 8 else NO_LOCK, 0.1 * k)
    found = row(watcher, "dvl", 4.0)
    assert found.condition is Condition.BAD
    assert found.freshness is Freshness.FRESH
    assert found.words == "no bottom lock for 3.3 s"


def test_bottom_lock_that_comes_and_goes_is_degraded(watcher, vehicle):
    for k in range(100):
        vehicle.tells("dvl", NO_LOCK if k % 4 == 0 else dvl(), 0.1 * k)
    found = row(watcher, "dvl", 10.0)
    assert found.condition is Condition.DEGRADED
    assert found.words == "bottom lock in 75% of the last minute"


def test_a_sensor_that_falls_silent_is_degraded_then_missing_and_says_for_how_long(watcher, vehicle):
    for k in range(20):
        vehicle.tells("dvl", dvl(), 0.1 * k)
    assert row(watcher, "dvl", 2.0).condition is Condition.OK
    stale = row(watcher, "dvl", 2.9)
    assert (stale.freshness, stale.condition) == (Freshness.STALE, Condition.DEGRADED)
    assert stale.words == "silent for 1.0 s"
    gone = row(watcher, "dvl", 6.9)
    assert (gone.freshness, gone.condition, gone.words) == (
        Freshness.GONE,
        Condition.MISSING,
        "silent for 5.0 s",
    )
    assert gone.rate_hz < 4.0


@pytest.mark.parametrize(
    ("signal", "good", "nothing", "words"),
    [
        ("attitude", (*LEVEL, *STILL), (math.nan,) * 4 + STILL, "no attitude for"),
        ("attitude", (*LEVEL, *STILL), (0.0,) * 4 + STILL, "no attitude for"),
        ("imu", imu(), (0.0,) * 6 + (20.0,), "no number, or all zero for"),
        ("imu", imu(), (math.nan,) * 6 + (20.0,), "no number, or all zero for"),
        ("fog", (0.1,), (math.nan,), "no rate for"),
        ("pressure", (101325.0, 20.0), (0.0, 20.0), "no pressure for"),
        ("battery", (15.9, 2.0), (math.nan, 2.0), "no voltage for"),
        ("pwm", (1500.0,) * 8, (math.nan,) * 8, "no commands for"),
    ],
)
def test_readings_that_say_nothing_are_bad(watcher, vehicle, signal, good, nothing, words):
    vehicle.tells(signal, good, 1.0)
    assert row(watcher, signal, 1.05).condition is Condition.OK
    vehicle.tells(signal, nothing, 1.2)
    found = row(watcher, signal, 1.25)
    assert found.condition is Condition.BAD
    assert found.words == f"{words} 0.2 s"


def test_an_altitude_beyond_reach_is_none(watcher, vehicle):
    vehicle.tells("altitude", (math.nan,), 1.0)
    assert row(watcher, "altitude", 1.5).words == "sees no bottom for 0.5 s"
    assert math.isnan(watcher.picture(1.5).traces["altitude"].value[0])


def test_a_sensor_slower_than_the_contract_is_degraded(watcher, vehicle):
    for k in range(100):
        vehicle.tells("imu", imu(), 0.1 * k)
    found = row(watcher, "imu", 10.0)
    assert found.condition is Condition.DEGRADED
    assert found.words == "slow: 10.0 of 25 Hz"


def test_voltage_far_below_the_thrust_curves_is_degraded(watcher, vehicle):
    for k in range(4):
        vehicle.tells("battery", (13.2, 2.0), float(k))
    found = row(watcher, "battery", 3.5)
    assert found.condition is Condition.DEGRADED
    assert found.words == "13.2 V, and the thrust curve is of 16 V"


def test_gnss_without_a_fix_is_no_fault_under_water(watcher, vehicle):
    vehicle.tells("gnss", (0.0, *(math.nan,) * 5, math.nan, 3.0), 1.0)
    found = row(watcher, "gnss", 1.2)
    assert (found.condition, found.words) == (Condition.OK, "no fix")


def test_a_device_set_slower_in_the_file_is_expected_slower(tmp_path):
    text = load_vehicle("ruvifist").path.read_text(encoding="utf-8")
    path = tmp_path / "slow.yaml"
    path.write_text(text.replace("kind: bar30,", "kind: bar30, rate_hz: 2.0,"), encoding="utf-8")
    watcher = Watcher(load_vehicle(str(path)))
    assert row(watcher, "pressure", 1.0).expected_hz == 2.0


def test_ardusub_is_asked_for_two_a_second_and_the_bridge_beside_it_for_the_contract(watcher):
    autopilot, bridge = OnAir(watcher), OnAir(watcher, component=191)
    autopilot.beats(0.0, autopilot=mav.MAV_AUTOPILOT_ARDUPILOTMEGA)
    for k in range(40):
        autopilot.says(mav.MAVLink_scaled_pressure2_message(500 * k, 1100.0, 0.0, 2000), 0.5 * k)
        bridge.tells("imu", imu(), 0.5 * k)
    assert row(watcher, "pressure", 20.0).expected_hz == 2.0
    assert row(watcher, "pressure", 20.0).condition is Condition.OK
    assert row(watcher, "imu", 19.6).expected_hz == 25.0
