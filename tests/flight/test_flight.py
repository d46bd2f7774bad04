"""The state machine of a flight: what it does, and how each thing that goes wrong ends it."""

import math
from dataclasses import replace

import pytest
from ideal import LIMITS, STILL, SURGE, Ideal, pushes

from bridge.flight.flight import End, State
from bridge.vehicle.legs import Leg
from bridge.vehicle.references import ZERO6


def test_it_counts_down_goes_to_its_station_flies_and_comes_back():
    vehicle = Ideal(depth_m=0.2)
    assert vehicle.begin(depth_m=1.5, countdown_s=5.0) == ""
    vehicle.until(State.WAITING)
    assert vehicle.depth_m == pytest.approx(1.5)
    assert vehicle.flight.fly(SURGE, vehicle.inputs()) == ""
    vehicle.run(7.9)
    assert pushes(vehicle.reference)
    vehicle.until(State.WAITING)
    vehicle.flight.finish()
    vehicle.until(State.IDLE)
    assert vehicle.was == [
        *(State.COUNTDOWN, State.GOING, State.WAITING, State.FLYING, State.GOING, State.WAITING),
        *(State.RETURNING, State.HOLDING, State.IDLE),
    ]
    assert (vehicle.flight.end, vehicle.flight.disarms) == (End.FINISHED, True)
    assert vehicle.depth_m == pytest.approx(0.2)


def test_nothing_steers_before_the_countdown_is_over():
    vehicle = Ideal()
    vehicle.begin(countdown_s=5.0)
    vehicle.run(4.95)
    assert (vehicle.flight.state, vehicle.reference) == (State.COUNTDOWN, None)
    assert vehicle.flight.left_s == pytest.approx(0.05)
    vehicle.run(0.1)
    assert vehicle.flight.state is State.GOING


def test_a_manoeuvre_is_the_mission_of_its_legs_from_the_stations_depth_and_heading():
    vehicle = Ideal()
    vehicle.begin()
    vehicle.until(State.WAITING)
    vehicle.flight.fly((Leg(2.0, heave_m_s=0.1, transient_s=2.0), Leg(3.0, heave_m_s=0.1)), vehicle.inputs())
    vehicle.run(4.0)
    assert vehicle.reference.nu[2] == 0.1
    assert vehicle.reference.depth_m == pytest.approx(1.5 + 0.1 + 0.2)
    assert vehicle.reference.heading_rad == pytest.approx(0.5)


def fault(name, value):
    return lambda vehicle: setattr(vehicle, name, value)


RETURNS = {
    "the ground is silent": (fault("ground", False), End.LINK),
    "the battery is low": (fault("voltage_v", 12.9), End.BATTERY),
    "the battery is not measured": (fault("voltage_v", math.nan), End.BATTERY),
    "the bottom is near": (fault("altitude_m", 0.9), End.ALTITUDE),
    "the bottom is not seen": (fault("altitude_m", math.nan), End.ALTITUDE),
    "it pushes too fast": (fault("pushed_m_s", 0.9), End.SPEED),
    "it is tilted": (fault("tilt_rad", math.radians(26.0)), End.TILT),
    "it is too deep": (lambda v: setattr(v.flight, "_limits", replace(LIMITS, deepest_m=1.4)), End.DEPTH),
    "it is too shallow": (
        lambda v: setattr(v.flight, "_limits", replace(LIMITS, shallowest_m=1.6)),
        End.DEPTH,
    ),
    "its time is up": (lambda v: setattr(v.flight, "_limits", replace(LIMITS, time_s=1.0)), End.TIME),
}


@pytest.mark.parametrize(("break_it", "end"), RETURNS.values(), ids=RETURNS)
def test_a_limit_ends_the_manoeuvre_and_it_goes_back(break_it, end):
    vehicle = Ideal().flying()
    break_it(vehicle)
    vehicle.until(State.RETURNING, within_s=4.0)
    assert vehicle.flight.end is end
    assert not pushes(vehicle.reference)
    vehicle.tilt_rad = 0.0
    vehicle.until(State.HOLDING)
    assert vehicle.flight.pose.distance_m(vehicle.flight._began) < 0.25
    assert not vehicle.flight.disarms
    vehicle.until(State.IDLE)
    assert (vehicle.flight.end, vehicle.flight.disarms) == (end, True)


def test_a_limit_of_distance_ends_it_before_the_vehicle_is_far_beyond():
    vehicle = Ideal(replace(LIMITS, distance_m=1.0)).flying((Leg(60.0, push_surge_n=10.0),))
    vehicle.pushed_m_s = 0.4
    vehicle.until(State.RETURNING)
    assert vehicle.flight.end is End.DISTANCE
    assert 1.0 < vehicle.flight.pose.distance_m(vehicle.flight._began) < 1.2


def test_one_bad_reading_ends_nothing():
    vehicle = Ideal().flying()
    vehicle.tilt_rad = 1.0
    vehicle.run(0.2)
    vehicle.tilt_rad = 0.0
    vehicle.run(0.2)
    vehicle.tilt_rad = 1.0
    vehicle.run(0.2)
    assert vehicle.flight.state is State.FLYING
    vehicle.run(0.1)
    assert vehicle.flight.end is End.TILT


BLIND = {"dvl": End.VELOCITY, "imu": End.HEADING, "depth_sensor": End.NO_DEPTH}


@pytest.mark.parametrize(("sensor", "end"), BLIND.items())
def test_without_a_sensor_it_holds_where_it_is_and_then_disarms(sensor, end):
    vehicle = Ideal().flying()
    setattr(vehicle, sensor, False)
    vehicle.until(State.HOLDING, within_s=1.2)
    assert vehicle.flight.end is end
    assert (vehicle.reference.nu, pushes(vehicle.reference)) == (ZERO6, False)
    assert (vehicle.reference.depth_m, vehicle.reference.heading_rad) == (
        vehicle.depth_m,
        vehicle.heading_rad,
    )
    vehicle.run(LIMITS.hold_s - 0.1)
    assert not vehicle.flight.disarms
    vehicle.run(0.2)
    assert (vehicle.flight.state, vehicle.flight.disarms, vehicle.reference) == (State.IDLE, True, None)


@pytest.mark.parametrize("state", [State.RETURNING, State.HOLDING])
@pytest.mark.parametrize("end", [End.SPEED, End.DEPTH])
def test_a_vehicle_that_its_thrusters_do_not_brake_on_the_way_back_or_as_it_holds_is_disarmed(state, end):
    """A DVL or a thruster turned round makes every push worse: it would push on until the way back is over."""
    vehicle = reached(state)
    began_s = vehicle.now_s
    while vehicle.flight.state is state:
        vehicle.tick()
        if end is End.SPEED:
            vehicle.velocity = (-0.9, 0.0, 0.0)
        else:
            vehicle.depth_m = LIMITS.deepest_m + 1.1
        assert vehicle.now_s < began_s + 3.2
    assert vehicle.now_s > began_s + 2.9
    assert (vehicle.flight.state, vehicle.flight.end, vehicle.flight.disarms) == (State.IDLE, end, True)


def test_a_vehicle_that_overshoots_and_brakes_is_not_disarmed():
    vehicle = Ideal().flying()
    vehicle.pushed_m_s = 0.9
    vehicle.until(State.RETURNING)
    for _ in range(50):
        vehicle.tick()
        vehicle.velocity = (0.9, 0.0, 0.0)
    vehicle.run(1.0)
    assert vehicle.flight.state is State.RETURNING
    vehicle = Ideal(replace(LIMITS, deepest_m=1.6)).flying()
    while vehicle.flight.state is not State.RETURNING:
        vehicle.depth_m = 2.7
        vehicle.tick()
    vehicle.until(State.HOLDING)
    assert vehicle.flight.end is End.DEPTH


@pytest.mark.parametrize("state", [State.GOING, State.WAITING, State.FLYING, State.RETURNING, State.HOLDING])
def test_a_depth_sensor_that_places_it_above_the_water_makes_it_hold_without_a_push_up_or_down(state):
    """It would dive by all its thrust for a depth that the sensor never tells."""
    vehicle = reached(state)
    vehicle.depth_m = -9.0
    vehicle.run(0.1)
    assert vehicle.flight.state is state
    for _ in range(8):
        vehicle.tick()
        vehicle.depth_m = -9.0
    assert vehicle.flight.state is State.HOLDING
    if state not in (State.RETURNING, State.HOLDING):
        assert vehicle.flight.end is End.NO_DEPTH
    assert vehicle.reference.nu == ZERO6
    assert vehicle.reference.push == (None, None, 0.0, None, None, None)


@pytest.mark.parametrize("sensor", BLIND)
def test_a_sensor_lost_on_the_way_back_makes_it_hold(sensor):
    vehicle = Ideal().flying()
    vehicle.ground = False
    vehicle.until(State.RETURNING)
    setattr(vehicle, sensor, False)
    vehicle.until(State.HOLDING, within_s=1.2)
    assert vehicle.flight.end is End.LINK


@pytest.mark.parametrize(
    "state", [State.COUNTDOWN, State.GOING, State.WAITING, State.FLYING, State.RETURNING, State.HOLDING]
)
def test_a_touched_stick_has_control_at_the_next_tick_whatever_it_was_doing(state):
    vehicle = reached(state)
    vehicle.sticks_moved = True
    vehicle.tick()
    assert (vehicle.flight.state, vehicle.flight.end, vehicle.reference) == (State.IDLE, End.STICKS, None)
    assert not vehicle.flight.disarms
    vehicle.sticks_moved = False
    vehicle.run(100.0)
    assert vehicle.flight.state is State.IDLE


@pytest.mark.parametrize("state", [State.GOING, State.WAITING, State.FLYING, State.RETURNING, State.HOLDING])
def test_a_disarmed_vehicle_flies_no_longer(state):
    vehicle = reached(state)
    vehicle.armed = False
    vehicle.tick()
    assert (vehicle.flight.state, vehicle.reference) == (State.IDLE, None)


def test_it_must_be_armed_when_the_countdown_is_over():
    vehicle = Ideal()
    vehicle.armed = False
    vehicle.begin(countdown_s=3.0)
    vehicle.run(2.95)
    assert vehicle.flight.state is State.COUNTDOWN
    vehicle.run(0.1)
    assert (vehicle.flight.state, vehicle.flight.end) == (State.IDLE, End.DISARMED)


@pytest.mark.parametrize("state", [State.GOING, State.WAITING, State.FLYING, State.RETURNING])
def test_the_end_key_holds_here_and_now(state):
    vehicle = reached(state)
    before = vehicle.flight.pose
    vehicle.flight.stop()
    vehicle.tick()
    assert (vehicle.flight.state, vehicle.flight.end) == (State.HOLDING, End.KEY)
    assert vehicle.reference.nu == ZERO6
    assert vehicle.reference.depth_m == pytest.approx(before.depth_m)


def test_a_countdown_that_ends_moves_nothing_and_disarms_but_for_the_pilot():
    vehicle = reached(State.COUNTDOWN)
    vehicle.flight.stop()
    assert (vehicle.flight.state, vehicle.flight.end, vehicle.flight.disarms) == (State.IDLE, End.KEY, True)
    vehicle = Ideal()
    vehicle.begin(countdown_s=10.0)
    vehicle.ground = False
    vehicle.run(3.2)
    assert (vehicle.flight.end, vehicle.flight.disarms, vehicle.reference) == (End.LINK, True, None)


@pytest.mark.parametrize("was_armed", [True, False])
def test_thrusters_in_other_hands_when_the_countdown_is_over_are_disarmed_only_if_the_flight_armed(was_armed):
    vehicle = Ideal()
    vehicle.armed = was_armed
    vehicle.begin(countdown_s=5.0)
    vehicle.armed, vehicle.in_command = True, False
    vehicle.run(5.1)
    assert (vehicle.flight.state, vehicle.flight.end) == (State.IDLE, End.TAKEN)
    assert vehicle.flight.disarms is not was_armed


def test_a_ground_that_comes_back_resumes_nothing():
    vehicle = Ideal().flying()
    vehicle.ground = False
    vehicle.until(State.RETURNING)
    vehicle.ground = True
    vehicle.until(State.HOLDING)
    assert vehicle.flight.fly(STILL, vehicle.inputs()) == "vehicle is not on its station"
    assert vehicle.begin() == "a flight is under way"


def test_a_vehicle_that_never_gets_to_its_station_goes_back_and_one_that_does_not_get_back_holds():
    vehicle = Ideal()
    vehicle.begin(depth_m=3.0)
    vehicle.until(State.GOING)
    lazy = vehicle.depth_m
    while vehicle.flight.state is not State.HOLDING:
        vehicle.tick()
        vehicle.depth_m = lazy + 1.0
        assert vehicle.now_s < 100.0 + 3.0 + 75.0 + 60.0 + 10.0
    assert vehicle.flight.end is End.ASTRAY


REFUSED = {
    "no velocity: put a DVL into the vehicle file, or see why that in it is silent": fault("dvl_s", 90.0),
    "no attitude: see why the IMU, or the autopilot in its place, is silent": fault("imu_s", 90.0),
    "no depth: see why the depth sensor, or the autopilot in its place, is silent": fault("depth_s", 90.0),
    "sticks are not at rest": fault("sticks_moved", True),
    "no battery measured: mend its sensor, or set battery_v 0 in the limits": fault("voltage_v", math.nan),
    "battery is 12.00 V, below battery_v 13 of the limits": fault("voltage_v", 12.0),
    "no altitude measured: mend its sensor, or set altitude_m 0 in the limits": fault("altitude_m", math.nan),
    "altitude is 0.50 m, below altitude_m 1 of the limits": fault("altitude_m", 0.5),
    "depth is -2.2 m, above the surface: set surface_pressure_hpa in the vehicle file, or mend the depth sensor": fault(
        "depth_m", -2.2
    ),
}


@pytest.mark.parametrize(("words", "break_it"), REFUSED.items())
def test_nothing_begins_with_what_is_missing(words, break_it):
    vehicle = Ideal()
    vehicle.dvl = vehicle.imu = vehicle.depth_sensor = False
    break_it(vehicle)
    assert vehicle.begin() == words
    assert vehicle.flight.state is State.IDLE


def test_an_altitude_or_a_battery_that_is_not_measured_any_more_counts_as_too_low_2_s_after_its_last_reading():
    for lost, end in (("altitude_m", End.ALTITUDE), ("battery", End.BATTERY)):
        vehicle = Ideal().flying()
        if lost == "altitude_m":
            # The bottom is seen no more: its last reading ages, while the velocity comes.
            inputs, last_s = vehicle.inputs, vehicle.now_s
            vehicle.inputs = lambda inputs=inputs, last_s=last_s: replace(
                (now := inputs()), navigation=replace(now.navigation, altitude_time_s=last_s)
            )
        else:
            last_s = vehicle.now_s
            vehicle.battery = False
        vehicle.until(State.RETURNING, 4.0)
        assert vehicle.flight.end is end
        assert 2.2 < vehicle.now_s - last_s < 2.4, "2 s, and a quarter for every limit"


def test_a_battery_just_below_its_limit_does_not_read_as_the_limit_itself():
    vehicle = Ideal()
    vehicle.voltage_v = 12.998
    assert vehicle.begin() == "battery is 12.99 V, below battery_v 13 of the limits"


def test_a_vehicle_that_measures_neither_altitude_nor_battery_flies_without_these_limits():
    vehicle = Ideal(replace(LIMITS, altitude_m=0.0, battery_v=0.0))
    vehicle.altitude_m = vehicle.voltage_v = math.nan
    vehicle.flying()
    vehicle.run(5.0)
    assert vehicle.flight.state is State.FLYING


@pytest.mark.parametrize("countdown_s", [0.0, 2.9, 61.0, math.nan])
def test_a_countdown_has_its_bounds(countdown_s):
    assert Ideal().begin(countdown_s=countdown_s) == "a countdown takes 3 to 60 s"


@pytest.mark.parametrize("depth_m", [0.2, 4.1, math.nan])
def test_the_plans_depth_must_lie_within_the_limits(depth_m):
    assert Ideal().begin(depth_m=depth_m) == "plan's depth is outside the limits"


def test_without_a_further_order_it_waits_a_minute_and_goes_back():
    vehicle = Ideal()
    vehicle.begin()
    vehicle.until(State.WAITING)
    vehicle.run(59.9)
    assert vehicle.flight.state is State.WAITING
    vehicle.run(0.2)
    assert (vehicle.flight.state, vehicle.flight.end) == (State.RETURNING, End.UNASKED)


def test_a_manoeuvre_longer_than_the_time_left_is_not_begun():
    vehicle = Ideal(replace(LIMITS, time_s=30.0))
    vehicle.begin()
    vehicle.until(State.WAITING)
    assert vehicle.flight.fly((Leg(26.0),), vehicle.inputs()) == "manoeuvre takes longer than is left"
    assert vehicle.flight.fly((), vehicle.inputs()) == "manoeuvre has no legs"
    assert vehicle.flight.state is State.WAITING


def reached(state):
    """A vehicle in that state."""
    vehicle = Ideal()
    if state in (State.COUNTDOWN, State.GOING, State.WAITING):
        vehicle.begin(depth_m=2.0)
        return vehicle.until(state)
    vehicle.flying()
    if state in (State.RETURNING, State.HOLDING):
        vehicle.flight.finish()
        vehicle.until(state)
    assert vehicle.flight.state is state
    return vehicle
