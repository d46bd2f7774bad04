"""The simulated vehicle with all aboard: what raising the mode while armed takes, and a ground that goes."""

from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect
from soak import rest_in_soak

from bridge.framing import Encoder, Framer, decode
from bridge.link.memory import memory_pair
from bridge.parameters import ParameterServer, vehicle_table
from bridge.simulator.body import Start
from bridge.simulator.dive import SimulatedVehicle
from bridge.simulator.missions import Leg, Mission
from bridge.simulator.truth import load_truth
from bridge.status_codes import CrewText, Topic, decoded
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.feedforward import Mode

FILE = load_vehicle("ruvifist")
GROUND = Encoder(255, 190)
AHEAD = Leg("ahead", "steady", 12.0, surge_m_s=0.4, transient_s=5.0)
BACK = Leg("back", "steady", 12.0, surge_m_s=-0.4, transient_s=5.0)
TO_AND_FRO = Mission("to and fro", (AHEAD, BACK) * 3)


def server(times: float) -> ParameterServer:
    """The true model, its mass and damping in surge so many times theirs."""
    parameters = ParameterServer(None, vehicle_table(FILE.vehicle))
    veh_cfg = FILE.vehicle.veh_cfg("hovering")
    for name, value in load_truth(FILE, "hovering").model.items():
        factor = times if name in ("M_u", "D_u") else 1.0
        assert parameters.write(f"FF{veh_cfg}_{name.upper()}", factor * value, armed=False) is None
    assert parameters.write("FF_COMMIT", float(parameters.staged_crc), armed=False) is None
    return parameters


class Dive:
    """The vehicle under way, and its ground."""

    def __init__(self, times: float = 1.0, mode: Mode = Mode.SHADOW) -> None:
        near, self.ground = memory_pair()
        self.parameters = server(times)
        self.parameters.write("FF_MODE", float(mode), armed=False)
        self.vehicle = SimulatedVehicle(FILE, "hovering", [near], Start(7, 0.6), self.parameters)
        assert self.vehicle.bridge.arm(True)
        self.framer = Framer()
        self.ticks = 0

    def fly(self, seconds: float) -> None:
        for _ in range(round(seconds * 20)):
            self.vehicle.tick(TO_AND_FRO.reference(self.ticks / 20))
            self.ticks += 1

    def asks(self, mode: Mode) -> list[Any]:
        """What the ground hears on its order, but for telemetry."""
        self.heard()
        self.ground.write(GROUND.encode(dialect.MAVLink_param_set_message(1, 1, b"FF_MODE", float(mode), 9)))
        self.fly(0.1)
        return [m for m in self.heard() if m.get_type() in ("PARAM_VALUE", "PARAM_ERROR", "STATUSTEXT")]

    def heard(self) -> list[Any]:
        frames = []
        while data := self.ground.read(0.0):
            frames += self.framer.feed(data)
        return [decode(frame) for frame in frames]


@pytest.mark.slow
def test_armed_it_is_raised_once_a_minute_of_shadow_has_been_good_and_not_before() -> None:
    dive = Dive()
    dive.fly(30.0)
    error, held, first, second = sorted(dive.asks(Mode.BOTH), key=lambda m: m.get_type())
    assert (error.error, held.param_value) == (3, 1.0)
    assert decoded(first.text).topic is Topic.UNPROVEN
    assert decoded(second.text) == CrewText("shadow: 28 of 60 s flown", Topic.SHADOW)
    dive.fly(33.0)
    (held,) = dive.asks(Mode.BOTH)
    assert held.param_value == 3.0
    assert dive.parameters.mode == Mode.BOTH


@pytest.mark.slow
@pytest.mark.parametrize("times", rest_in_soak([0.3, 2.0]))
def test_armed_a_model_that_the_water_contradicts_is_not_raised_however_long_it_was_shadowed(
    times: float,
) -> None:
    dive = Dive(times)
    dive.fly(66.0)
    texts = [m.text for m in dive.asks(Mode.BOTH) if m.get_type() == "STATUSTEXT"]
    assert texts[1].endswith("% of surge explained, needs 70")
    assert dive.parameters.mode == Mode.SHADOW
    assert dive.vehicle.bridge.arm(False)
    (held,) = dive.asks(Mode.BOTH)
    assert held.param_value == 3.0


def test_a_ground_that_falls_silent_or_whose_link_breaks_changes_no_pulse_on_board() -> None:
    heard, silent, broken = (Dive(mode=Mode.BOTH) for _ in range(3))
    beat = GROUND.encode(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    pulses: list[list[tuple[float, ...]]] = [[], [], []]
    for second in range(12):
        heard.ground.write(beat)
        if second < 5:
            silent.ground.write(beat)
            broken.ground.write(beat)
        if second == 5:
            broken.ground.close()
        for dive, flown in zip((heard, silent, broken), pulses, strict=True):
            for _ in range(20):
                dive.fly(0.05)
                flown.append(tuple(dive.vehicle.body.pwm_us))
    assert pulses[0] == pulses[1] == pulses[2]
    assert len(set(pulses[0])) > 200
    assert all(dive.vehicle.bridge.armed and dive.parameters.mode == Mode.BOTH for dive in (silent, broken))
    assert "memory" in " ".join(broken.vehicle.bridge.link_faults.values())
