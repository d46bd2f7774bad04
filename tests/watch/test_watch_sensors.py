"""Rows of sensors and traces of the last minute."""

import math

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav
from scipy.spatial.transform import Rotation
from vehicle_on_air import LEVEL, NO_LOCK, STILL, OnAir, dvl, imu

from bridge import exit_codes
from bridge.vehicle.config import load_vehicle
from gcs_plugin.recording.state import Holding
from gcs_plugin.watch.picture import Condition, Freshness, freshness
from gcs_plugin.watch.trace_ring import TraceRing
from gcs_plugin.watch.watcher import Watcher
from tui.commands.watch import code
from tui.watch_text import header, trouble


@pytest.fixture
def vehicle(vehicle):
    vehicle.beats(0.0)
    return vehicle


def row(watcher, signal, now_s):
    (result,) = [row for row in watcher.picture(now_s).sensors if row.signal == signal]
    return result


def test_a_value_is_stale_after_three_periods_and_gone_after_ten():
    assert freshness(0.59, 5.0) is Freshness.FRESH
    assert freshness(0.61, 5.0) is Freshness.STALE
    assert freshness(2.01, 5.0) is Freshness.GONE
    assert freshness(math.inf, 5.0) is Freshness.GONE


COMES_AND_GOES = [NO_LOCK, dvl(), dvl(), dvl()] * 25
TURNED = (*LEVEL, *STILL)
NO_FIX = (0.0, *(math.nan,) * 5, math.nan, 3.0)


@pytest.mark.parametrize(
    ("signal", "said", "every_s", "now_s", "condition", "words"),
    [
        ("dvl", [dvl()] * 8 + [NO_LOCK] * 32, 0.1, 4.0, Condition.BAD, "no bottom lock for 3.3 s"),
        ("dvl", COMES_AND_GOES, 0.1, 10.0, Condition.DEGRADED, "bottom lock in 75% of the last minute"),
        ("imu", [imu()] * 100, 0.1, 10.0, Condition.DEGRADED, "slow: 10.0 of 25 Hz"),
        ("battery", [(13.2, 2.0)] * 4, 1.0, 3.5, Condition.DEGRADED, "13.2 V, and the thrust curve is of 16 V"),
        ("gnss", [NO_FIX], 1.0, 0.2, Condition.OK, "no fix"),
        ("altitude", [(math.nan,)], 1.0, 0.5, Condition.BAD, "sees no bottom for 0.5 s"),
        ("attitude", [TURNED, (math.nan,) * 4 + STILL], 0.2, 0.25, Condition.BAD, "no attitude for 0.2 s"),
        ("attitude", [TURNED, (0.0,) * 4 + STILL], 0.2, 0.25, Condition.BAD, "no attitude for 0.2 s"),
        ("imu", [imu(), (0.0,) * 6 + (20.0,)], 0.2, 0.25, Condition.BAD, "no number, or all zero for 0.2 s"),
        ("imu", [imu(), (math.nan,) * 6 + (20.0,)], 0.2, 0.25, Condition.BAD, "no number, or all zero for 0.2 s"),
        ("fog", [(0.1,), (math.nan,)], 0.2, 0.25, Condition.BAD, "no rate for 0.2 s"),
        ("pressure", [(101325.0, 20.0), (0.0, 20.0)], 0.2, 0.25, Condition.BAD, "no pressure for 0.2 s"),
        ("battery", [(15.9, 2.0), (math.nan, 2.0)], 0.2, 0.25, Condition.BAD, "no voltage for 0.2 s"),
        ("pwm", [(1500.0,) * 8, (math.nan,) * 8], 0.2, 0.25, Condition.BAD, "no commands for 0.2 s"),
    ],
)  # fmt: skip
def test_a_sensor_is_judged_by_what_it_said(watcher, vehicle, signal, said, every_s, now_s, condition, words):
    for k, values in enumerate(said):
        vehicle.tells(signal, values, every_s * k)
    result = row(watcher, signal, now_s)
    assert (result.freshness, result.condition, result.words) == (Freshness.FRESH, condition, words)


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


@pytest.mark.usefixtures("vehicle")
@pytest.mark.parametrize(("signal", "listened_s"), [("imu", 5.0), ("gnss", 10.0)])
def test_a_sensor_is_called_never_heard_once_it_had_time_to_speak(watcher, signal, listened_s):
    early = row(watcher, signal, listened_s)
    assert (early.condition, early.words) == (Condition.AWAITED, "not heard yet")
    assert not any(words.startswith(early.name) for words in trouble(watcher.picture(listened_s)))
    late = row(watcher, signal, listened_s + 0.1)
    assert (late.condition, late.words) == (Condition.MISSING, "never heard; check the device and its port")


@pytest.mark.usefixtures("vehicle")
def test_a_look_that_ends_before_a_sensor_spoke_did_not_hear_it(watcher):
    picture = watcher.picture(3.0)
    assert {row.condition for row in picture.sensors} == {Condition.AWAITED}
    assert code(1, picture, once=True) == exit_codes.NO


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


def test_without_a_heartbeat_of_ones_own_no_companion_is_heard_beside_ardusub_and_this_is_said(watcher):
    generic = OnAir(watcher)
    generic.beats(0.0)
    assert watcher.picture(1.0).hidden == ""
    generic.beats(1.0, autopilot=mav.MAV_AUTOPILOT_ARDUPILOTMEGA)
    picture = watcher.picture(2.0)
    assert "seatrial record hears it" in picture.hidden
    assert picture.hidden in header(picture, None)
    recorded = Holding(1, "", (), "dives/a", "", 0, 0, 0, math.inf, (), 0.0)
    assert picture.hidden not in header(picture, recorded)
    companion = {"kind": mav.MAV_TYPE_ONBOARD_CONTROLLER, "autopilot": mav.MAV_AUTOPILOT_INVALID}
    OnAir(watcher, component=191).beats(2.0, **companion)
    assert watcher.picture(3.0).hidden == ""


RUVIFIST = load_vehicle("ruvifist")
REFERENCE = (0.4, 0.1, 0.2, 0.01, 0.02, 0.03) + (0.0,) * 6 + (-math.pi / 2, 1.5)


def last(watcher, key, now_s):
    return watcher.picture(now_s).traces[key].value[-1]


def test_a_ring_keeps_the_newest_of_a_step_and_no_more_than_twenty_a_second():
    ring = TraceRing()
    for k in range(1000):
        ring.put(0.01 * k, float(k))
    time_s, value, reference = ring.since(0.0)
    assert len(time_s) <= 201
    assert (time_s[-1], value[-1]) == (pytest.approx(9.99), 999.0)
    assert reference is None


def test_only_the_last_minute_is_shown(watcher, vehicle):
    for k in range(100):
        vehicle.tells("dvl", dvl(), float(k))
    trace = watcher.picture(99.5).traces["u"]
    assert trace.time_s[0] == 40.0
    assert trace.age_s == pytest.approx(0.5)
    assert trace.freshness is Freshness.FRESH
    assert watcher.picture(110.0).traces["u"].freshness is Freshness.GONE


def test_velocity_rates_depth_and_heading_stand_beside_their_references(watcher, vehicle):
    vehicle.tells("nu_ref", REFERENCE, 1.0)
    vehicle.tells("dvl", dvl(0.3, -0.1, 0.05), 1.05)
    vehicle.tells("imu", imu(0.1, 0.2, 0.3), 1.05)
    vehicle.tells("attitude", (*LEVEL, *STILL), 1.05)
    water = RUVIFIST.vehicle.water
    at_two_metres = 100 * water.surface_pressure_hpa + 2.0 * water.density_kg_m3 * water.gravity_m_s2
    vehicle.tells("pressure", (at_two_metres, 20.0), 1.1)
    traces = watcher.picture(1.2).traces
    results = {
        key: (float(t.value[-1]), float(t.reference[-1]))
        for key, t in traces.items()
        if t.reference is not None
    }
    assert results == {
        "u": pytest.approx((0.3, 0.4)), "v": pytest.approx((-0.1, 0.1)), "w": pytest.approx((0.05, 0.2)),
        "p": pytest.approx((0.1, 0.01)), "q": pytest.approx((0.2, 0.02)), "r": pytest.approx((0.3, 0.03)),
        "depth": pytest.approx((2.0, 1.5), abs=1e-4), "heading": pytest.approx((0.0, 270.0), abs=1e-4),
    }  # fmt: skip


def test_a_reference_that_is_no_longer_told_ends(watcher, vehicle):
    vehicle.tells("nu_ref", REFERENCE, 1.0)
    vehicle.tells("dvl", dvl(), 1.1)
    vehicle.tells("dvl", dvl(), 3.0)
    reference = watcher.picture(3.0).traces["u"].reference
    assert reference[0] == pytest.approx(0.4)
    assert math.isnan(reference[1])


def test_yaw_rate_is_the_fibre_optic_gyros_while_it_speaks(watcher, vehicle):
    vehicle.tells("fog", (0.5,), 1.0)
    vehicle.tells("imu", imu(r=0.4), 1.1)
    assert last(watcher, "r", 1.2) == pytest.approx(0.5)
    vehicle.tells("imu", imu(r=0.4), 3.0)
    assert last(watcher, "r", 3.1) == pytest.approx(0.4)


@pytest.fixture
def off_the_centre(tmp_path):
    """A watch of a vehicle whose DVL is off its origin."""
    text = RUVIFIST.path.read_text(encoding="utf-8")
    path = tmp_path / "off.yaml"
    path.write_text(
        text.replace("rotation_deg: [180.0, 0.0, 135.0]", "position_m: [0.5, 0.2, -0.4]"), encoding="utf-8"
    )
    return Watcher(load_vehicle(str(path)))


def test_velocity_is_that_of_the_bodys_origin(off_the_centre):
    watcher = off_the_centre
    vehicle = OnAir(watcher)
    vehicle.beats(0.0)
    rates = (0.3, -0.1, 0.2)
    vehicle.tells("imu", imu(*rates), 1.0)
    vehicle.tells("dvl", dvl(*np.cross(rates, (0.5, 0.2, -0.4))), 1.1)
    assert [last(watcher, key, 1.2) for key in "uvw"] == pytest.approx([0.0] * 3, abs=1e-6)


@pytest.mark.parametrize("is_ours", [True, False])
def test_the_velocity_that_our_companion_tells_an_autopilot_is_the_origins_already(off_the_centre, is_ours):
    rates, at = (0.3, -0.1, 0.2), (0.5, 0.2, -0.4)
    OnAir(off_the_centre).beats(0.0)
    companion = OnAir(off_the_centre, component=191)
    if is_ours:
        companion.tells("tau_cmd", (0.0,) * 6, 0.5)
    companion.tells("imu", imu(*rates), 1.0)
    step_m = [0.1 * v for v in (0.4, 0.0, 0.0)]
    companion.says(mav.MAVLink_vision_position_delta_message(0, 100_000, (0, 0, 0), step_m, 100), 1.1)
    origin = (0.4, 0.0, 0.0) if is_ours else np.array((0.4, 0.0, 0.0)) - np.cross(rates, at)
    assert [last(off_the_centre, key, 1.2) for key in "uvw"] == pytest.approx([*origin], abs=1e-6)


def test_ardusub_tells_attitude_rates_depth_thrusters_and_battery_in_its_own_messages():
    watcher = Watcher(load_vehicle("ardusub_vectored"))
    sub = OnAir(watcher)
    sub.beats(0.0, autopilot=mav.MAV_AUTOPILOT_ARDUPILOTMEGA)
    sub.says(mav.MAVLink_attitude_message(1000, 0.1, -0.2, 2.0, 0.01, 0.02, 0.03), 1.0)
    sub.says(mav.MAVLink_vfr_hud_message(0, 0, 0, 0, -3.25, 0), 1.0)
    sub.says(mav.MAVLink_servo_output_raw_message(10**6, 0, *range(1501, 1507), 0, 0), 1.0)
    sub.says(mav.MAVLink_servo_output_raw_message(10**6, 1, *range(1601, 1607), 0, 0), 1.0)
    sub.says(mav.MAVLink_sys_status_message(0, 0, 0, 0, 15100, 1230, 50, 0, 0, 0, 0, 0, 0), 1.0)
    picture = watcher.picture(1.1)
    values = {key: float(t.value[-1]) for key, t in picture.traces.items() if len(t.value)}
    assert values == pytest.approx(
        {
            "p": 0.01,
            "q": 0.02,
            "r": 0.03,
            "depth": 3.25,
            "heading": math.degrees(2.0),
            "voltage": 15.1,
            "current": 12.3,
        }
    )
    assert [row.pwm_us for row in picture.thrusters] == list(range(1501, 1507))


def test_depth_that_the_vehicle_states_comes_before_that_of_its_pressure(watcher, vehicle):
    vehicle.says(mav.MAVLink_global_position_int_message(1000, 0, 0, 0, -4000, 0, 0, 0, 0), 1.0)
    vehicle.tells("pressure", (101325.0, 20.0), 1.1)
    assert last(watcher, "depth", 1.2) == pytest.approx(4.0)


@pytest.mark.usefixtures("vehicle")
def test_a_dvl_driver_under_a_ground_stations_name_is_heard(watcher):
    driver = OnAir(watcher, 255, 0)
    delta = mav.MAVLink_vision_position_delta_message(10**6, 100_000, [0.0] * 3, [0.03, 0.0, -0.01], 90.0)
    driver.says(delta, 1.0)
    assert last(watcher, "u", 1.1) == pytest.approx(0.3)
    assert last(watcher, "w", 1.1) == pytest.approx(-0.1)


def test_a_dvl_driver_of_another_vehicle_is_not_heard(watcher, vehicle):
    def delta(ahead_m):
        moved = [ahead_m, 0.0, 0.0]
        return mav.MAVLink_vision_position_delta_message(10**6, 100_000, [0.0] * 3, moved, 90.0)

    other = OnAir(watcher, 7)
    other.beats(0.9)
    vehicle.says(delta(0.02), 1.0)
    other.says(delta(0.09), 1.05)
    OnAir(watcher, 7, 191).says(delta(0.09), 1.06)
    assert last(watcher, "u", 1.1) == pytest.approx(0.2)


def test_an_autopilots_velocity_is_turned_into_body_axes_where_no_dvl_speaks(watcher, vehicle):
    turned = Rotation.from_euler("ZYX", (70.0, 20.0, -30.0), degrees=True)
    x, y, z, w = turned.as_quat()
    vehicle.tells("attitude", (w, x, y, z, *STILL), 1.0)
    vehicle.says(mav.MAVLink_local_position_ned_message(1000, 0, 0, 0, 0.3, 0.7, 0.1), 1.1)
    results = [last(watcher, key, 1.2) for key in "uvw"]
    assert results == pytest.approx(turned.inv().apply((0.3, 0.7, 0.1)), abs=1e-6)
    vehicle.tells("dvl", dvl(0.2), 1.3)
    vehicle.says(mav.MAVLink_local_position_ned_message(1200, 0, 0, 0, 0.0, 0.7, 0.1), 1.4)
    assert last(watcher, "u", 1.5) == pytest.approx(0.2)


def test_the_contracts_message_comes_before_ardusubs_until_it_is_silent(watcher, vehicle):
    vehicle.tells("attitude", (*LEVEL, *STILL), 1.0)
    vehicle.says(mav.MAVLink_attitude_message(1000, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0), 1.5)
    assert last(watcher, "heading", 1.6) == pytest.approx(0.0)
    vehicle.says(mav.MAVLink_attitude_message(1000, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0), 5.0)
    assert last(watcher, "heading", 5.1) == pytest.approx(math.degrees(1.0))
