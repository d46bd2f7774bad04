"""A vehicle that does exactly what its reference says, and a flight on it, tick by tick, with switches."""

import math

from bridge.flight.flight import Flight, FlightInputs, State
from bridge.flight.limits import FlightLimits
from bridge.vehicle.legs import Leg
from bridge.vehicle.navigation import Navigation
from bridge.vehicle.references import NO_PUSH

TICK_S = 0.05
LIMITS = FlightLimits(0.3, 4.0, 1.0, 4.0, 0.8, 25.0, 13.0, 900.0)
SURGE = (Leg(2.0, push_surge_n=20.0), Leg(4.0, push_surge_n=-20.0), Leg(2.0, push_surge_n=20.0))
STILL = (Leg(8.0),)


class Ideal:
    """Attributes are its state and its faults: `ground`, `dvl`, `imu`, `depth_sensor` False for one that is silent;
    `sticks_moved`; `in_command` False for thrusters in other hands; `tilt_rad`, `voltage_v`, `altitude_m`. A push moves
    it at `pushed_m_s` along the axis of that push."""

    def __init__(self, limits=LIMITS, *, depth_m=1.5, sways=True):
        self.flight, self.limits = Flight(sways=sways), limits
        self.now_s, self.armed = 100.0, True
        self.ground = self.dvl = self.imu = self.depth_sensor = self.battery = True
        self.in_command = True
        self.sticks_moved, self.tilt_rad, self.voltage_v, self.altitude_m = False, 0.0, 16.0, 6.0
        self.pushed_m_s = 0.0
        self.depth_m, self.heading_rad, self.velocity = depth_m, 0.5, (0.0, 0.0, 0.0)
        self.ground_s = self.dvl_s = self.imu_s = self.depth_s = self.battery_s = self.now_s
        self.reference, self.was = None, []

    def inputs(self):
        self.ground_s = self.now_s if self.ground else self.ground_s
        self.dvl_s = self.now_s if self.dvl else self.dvl_s
        self.imu_s = self.now_s if self.imu else self.imu_s
        self.depth_s = self.now_s if self.depth_sensor else self.depth_s
        self.battery_s = self.now_s if self.battery else self.battery_s
        half, tilt = self.heading_rad / 2, self.tilt_rad / 2
        attitude = (
            math.cos(half) * math.cos(tilt),
            math.cos(half) * math.sin(tilt),
            math.sin(half) * math.sin(tilt),
            math.sin(half) * math.cos(tilt),
        )
        navigation = Navigation(
            self.velocity, self.dvl_s, (0.0, 0.0, 0.0), self.imu_s, attitude, self.heading_rad, self.imu_s,
            self.depth_m, self.depth_s, self.voltage_v, self.altitude_m, self.dvl_s, self.battery_s,
        )  # fmt: skip
        return FlightInputs(
            self.now_s, navigation, self.armed, self.ground_s, self.sticks_moved, self.in_command
        )

    def begin(self, depth_m=1.5, countdown_s=3.0):
        return self.flight.begin(self.limits, depth_m, countdown_s, self.inputs())

    def tick(self):
        """A tick of control: it moves as the reference wants."""
        self.now_s = round(self.now_s + TICK_S, 6)
        self.reference = self.flight.step(self.inputs())
        if not self.was or self.was[-1] is not self.flight.state:
            self.was.append(self.flight.state)
        self.velocity = (0.0, 0.0, 0.0)
        if self.reference is not None:
            u, v, w = self.reference.nu[:3]
            pushes = [
                0.0 if push is None else math.copysign(self.pushed_m_s, push)
                for push in self.reference.push[:2]
            ]
            self.velocity = (u + pushes[0], v + pushes[1], w)
            self.heading_rad, self.depth_m = self.reference.heading_rad, self.reference.depth_m

    def run(self, seconds):
        for _ in range(round(seconds / TICK_S)):
            self.tick()

    def until(self, state, within_s=120.0):
        end_s = self.now_s + within_s
        while self.flight.state is not state:
            assert self.now_s < end_s, (self.flight.state, self.flight.end, self.flight.pose)
            self.tick()
        return self

    def flying(self, legs=SURGE):
        """It flies a manoeuvre."""
        assert self.begin() == ""
        self.until(State.WAITING)
        assert self.flight.fly(legs, self.inputs()) == ""
        self.run(1.0)
        assert self.flight.state is State.FLYING
        return self


def pushes(reference):
    """Whether the reference pushes."""
    return reference is not None and reference.push != NO_PUSH
