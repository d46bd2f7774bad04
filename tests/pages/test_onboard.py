"""The code of the page on a vehicle's own control program flies the simulated body as the page says."""

import re
from dataclasses import replace
from types import SimpleNamespace

import pytest
from page_runner import ROOT

from bridge.clock import SimulatedClock
from bridge.flight.flight import End, FlightInputs, State
from bridge.flight.limits import FlightLimits
from bridge.links.link import memory_pair
from bridge.onboard.flights import Flights
from bridge.onboard.orders import MotorTests
from bridge.onboard.parameters import ParameterServer
from bridge.onboard.service import Bridge
from bridge.simulator.body import SimulatedBody, Start
from bridge.simulator.dive import TICK_S
from bridge.vehicle.autopilot import Autopilot
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.parameters import vehicle_table
from bridge.vehicle.references import ZERO6, Reference
from bridge.wire.framing import Framer, decode

AHEAD = Reference((0.3, 0, 0, 0, 0, 0), ZERO6, 0.0, 1.5)
LIMITS = FlightLimits(0.3, 4, 0, 4, 0.8, 25, 0, 900)
REST = [1500.0] * 8


class Program:
    """The page's blocks of Python as a program that flies the simulated body; `wanted` is what its mission wants."""

    def __init__(self) -> None:
        file = load_vehicle("ruvifist:hovering")
        vehicle, near = file.vehicle, memory_pair()
        self.wanted: Reference | None = None
        self.body = SimulatedBody(file, "hovering", Start(1, depth_m=1.5))
        self.clock, self.ground = SimulatedClock(), near[1]
        parameters = ParameterServer(None, vehicle_table(vehicle))
        self.link = Bridge(vehicle, self.clock, [near[0]], parameters, veh_cfg=1)
        self.pwm_us: list[float] = []
        self.names = {
            "Flights": Flights, "MotorTests": MotorTests, "Reference": Reference, "vehicle": vehicle,
            "configuration": "hovering", "clock": self.clock, "link": self.link, "parameters": parameters,
            "autopilot": Autopilot(vehicle, "hovering", parameters.active, file.path.parent),
            "mission": SimpleNamespace(reference=lambda _: self.wanted), "write_pwm": self.write_pwm,
        }  # fmt: skip
        for block in re.findall(r"```python\n(.*?)```", (ROOT / "docs/onboard.md").read_text("utf-8"), re.S):
            exec(block, self.names)

    def write_pwm(self, pwm_us) -> None:
        self.pwm_us = [float(pulse) for pulse in pwm_us]
        self.body.pwm_us = tuple(pwm_us)

    def run(self, seconds: float) -> list[str]:
        """Run its ticks for so long; what the crew hears meanwhile."""
        said, framer = [], Framer()
        for _ in range(round(seconds / TICK_S)):
            for arrival in self.body.move(TICK_S)[1]:
                self.clock.advance_to(max(arrival.time_s, self.clock.boot_s()))
                self.link.take(arrival)
            self.clock.advance_to(max(self.body.time_s, self.clock.boot_s()))
            self.names["tick"]()
            self.link.step()
            heard = map(decode, framer.feed(self.ground.read(0.0)))
            said += [message.text for message in heard if message and message.get_type() == "STATUSTEXT"]
        return said

    def begin_flight(self) -> None:
        now_s = self.clock.boot_s()
        self.link.flights.hear(SimpleNamespace(get_type=lambda: "HEARTBEAT"), now_s)
        seen = FlightInputs(now_s, self.link.navigation, self.link.armed, now_s)
        assert self.link.flights.flight.begin(replace(LIMITS, link_s=10.0), 1.5, 3.0, seen) == ""


@pytest.fixture
def program():
    return Program()


def test_the_loop_that_is_shown_flies_the_mission_and_tells_the_crew_what_is_off(program):
    program.run(1.0)
    assert program.pwm_us == REST
    program.wanted = AHEAD
    said = program.run(1.0)
    assert "F6 FF surge off: M_u is missing" in said
    assert program.pwm_us == REST, "it is disarmed"
    program.link.arm(True)
    program.run(1.0)
    assert max(program.pwm_us) > 1550


def test_a_flight_of_the_loop_that_is_shown_is_over_once_the_vehicle_is_disarmed(program):
    program.run(1.0)
    program.begin_flight()
    program.link.arm(True)
    program.run(4.0)
    flight = program.link.flights.flight
    assert flight.state in (State.GOING, State.WAITING)
    program.link.arm(False)
    program.run(0.5)
    program.link.arm(True)
    program.run(0.5)
    assert (flight.state, flight.end) == (State.IDLE, End.DISARMED)
    assert program.pwm_us == REST


def test_where_nothing_flies_the_loop_that_is_shown_turns_a_thruster_for_the_check_in_the_water(program):
    program.link.arm(True)
    program.run(0.1)
    asked = SimpleNamespace(param1=3.0, param2=1.0, param3=1600.0, param4=1.0)
    assert program.link.motor_tests.ask(asked, armed=True, now_s=program.clock.boot_s()) == 0
    program.run(0.1)
    assert program.pwm_us == [1600.0 if thruster == 2 else 1500.0 for thruster in range(8)]
