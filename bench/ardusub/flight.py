"""A plan flown by sticks in ArduSub's ALT_HOLD, recorded by the companion beside it: a dive of the real firmware."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bench.ardusub.firmware import SETTINGS, BodyClock, Firmware, Script, wait_until
from bridge.ardusub.companion import Companion, companion_file
from bridge.ardusub.law import ALT_HOLD
from bridge.ardusub.mixing import Mixer
from bridge.links.link import Link
from bridge.onboard.orders import Ground
from bridge.onboard.parameters import ParameterServer
from bridge.onboard.ring import Bounds, ring_in
from bridge.onboard.service import Bridge
from bridge.sensors.samples import DvlSample
from bridge.simulator.json_plant import json_body
from bridge.simulator.missions import Mission
from bridge.simulator.truth import NoiseLevels, Truth
from bridge.vehicle.config import Device, Sensors, VehicleFile, load_vehicle
from bridge.vehicle.parameters import vehicle_table
from bridge.vehicle.thrusters import thrust_curve
from bridge.wire.framing import Encoder, Framer, decode

VEHICLE: Final = "bluerov2"
DEPTH_M: Final = 8.0
STICKS_S, DVL_S, BEAT_S, DISK_S = 0.04, 0.1, 1.0, 0.5
GAIN: Final = SETTINGS["JS_GAIN_DEFAULT"]
TURN_RAD_S: Final = math.radians(202.5)
"""Rate that a full stick asks for at a gain of 1 in ALT_HOLD: 45 degrees times ACRO_YAW_P."""
CLIMB_M_S, DEAD = 5.0, 0.2
"""Likewise up and down, PILOT_SPEED_UP, beyond the share of the stick that is THR_DZ's."""
RING: Final = Bounds(1 << 30, 1 << 30)


def vehicle_with_dvl() -> VehicleFile:
    """The BlueROV2 of configs with a Water Linked A50 on it."""
    file = load_vehicle(VEHICLE)
    return replace(file, vehicle=replace(file.vehicle, sensors=Sensors(dvl=Device("a50"))))


class Pilot:
    """A ground station with a joystick: beats, and sends its sticks 25 times a second."""

    def __init__(self, link: Link, clock: BodyClock) -> None:
        self._link, self._clock = link, clock
        self._encoder, self._framer = Encoder(255, 190), Framer()
        self.sticks = {"x": 0, "y": 0, "z": 500, "r": 0}
        self._beat_s = self._sticks_s = 0.0
        self.standing_by = self.armed = False
        self.texts: list[str] = []

    def step(self) -> None:
        now_s = self._clock.boot_s()
        if now_s >= self._beat_s:
            self._beat_s = now_s + BEAT_S
            self.send(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
        if now_s >= self._sticks_s:
            self._sticks_s = now_s + STICKS_S
            self.send(dialect.MAVLink_manual_control_message(1, **self.sticks, buttons=0))
        while data := self._link.read(0.0):
            for frame in self._framer.feed(data):
                if frame.message_id == dialect.MAVLINK_MSG_ID_HEARTBEAT and frame.component == 1:
                    self._heartbeat(decode(frame))
                elif frame.message_id == dialect.MAVLINK_MSG_ID_STATUSTEXT and (text := decode(frame)):
                    self.texts.append(text.text)

    def send(self, message: Any) -> None:
        self._link.write(self._encoder.encode(message))

    def command(self, number: int, *parameters: float) -> None:
        filled = (*parameters, *(0.0,) * (7 - len(parameters)))
        self.send(dialect.MAVLink_command_long_message(1, 1, number, 0, *filled))

    def _heartbeat(self, beat: Any) -> None:
        if beat is not None:
            self.standing_by = beat.system_status >= dialect.MAV_STATE_STANDBY
            self.armed = bool(beat.base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED)


@dataclass(frozen=True)
class Flown:
    """What a flight left: the companion's recording, and the texts that the ground heard."""

    recording: Path
    texts: tuple[str, ...]


def fly(
    path: Path,
    folder: Path,
    mission: Mission,
    truth: Truth,
    *,
    settings: Mapping[str, float] = SETTINGS,
    seed: int = 1,
) -> Flown:
    """Fly a mission of pushes and rates with the firmware at `path`, the body being `truth`.

    `folder` is made; the recording lies in it. Raises LinkError where the firmware does not do its part.
    """
    file = companion_file(vehicle_with_dvl())
    configuration = next(iter(file.vehicle.configurations))
    body = json_body(file, configuration, truth, seed=seed, depth_m=DEPTH_M)
    firmware = Firmware(path, folder, body, settings)
    try:
        clock = firmware.clock
        ring = ring_in(folder / "ring", RING, clock)
        parameters = ParameterServer(None, vehicle_table(file.vehicle), component=191)
        companion = Companion(file, configuration, parameters, Ground(), None)
        bridge = Bridge(file.vehicle, clock, [firmware.aboard], parameters, companion=companion, ring=ring)
        pilot = Pilot(firmware.ground, clock)
        noise, levels = np.random.default_rng(seed), NoiseLevels()
        due = {"dvl": 0.0, "disk": 0.0}

        def act() -> None:
            now_s = clock.boot_s()
            if now_s >= due["dvl"]:
                due["dvl"] = now_s + DVL_S
                velocity = (body.state[7:10] + levels.dvl_m_s * noise.standard_normal(3)).tolist()
                bridge.accept("dvl", (DvlSample(now_s, tuple(velocity), math.nan, 20.0),))
            if now_s >= due["disk"]:
                due["disk"] = now_s + DISK_S
                ring.work()
            bridge.step()
            pilot.step()

        shape = file.vehicle.configurations[configuration]
        curve = thrust_curve(file.vehicle.thrust_curve, file.path.parent)
        mixer = Mixer(int(settings["FRAME_CONFIG"]), (1.0,) * len(shape.thrusters), shape, curve)
        firmware.fly(_with(act, _flight(clock, companion, pilot, mixer, mission)))
        ring.work()
        ring.close()
        (recording,) = (folder / "ring").iterdir()
        return Flown(recording, tuple(pilot.texts))
    finally:
        firmware.close()


def _with(act: Any, script: Script) -> Script:
    for _ in script:
        act()
        yield


def _flight(clock: BodyClock, companion: Companion, pilot: Pilot, mixer: Mixer, mission: Mission) -> Script:
    yield from wait_until(
        clock,
        lambda: companion.settings.complete and companion.rates.settled,
        90.0,
        "the autopilot's parameters",
    )
    yield from wait_until(clock, lambda: pilot.standing_by, 60.0, "the autopilot's start")
    calm_s = clock.boot_s() + 6.0
    yield from wait_until(clock, lambda: clock.boot_s() > calm_s, 10.0, "the calm before arming")
    pilot.command(dialect.MAV_CMD_DO_SET_MODE, 1.0, float(ALT_HOLD))
    asked_s = -math.inf
    while not pilot.armed:
        if clock.boot_s() > asked_s + 1.5:
            asked_s = clock.boot_s()
            pilot.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1.0, 21196.0)
        yield
    began_s = clock.boot_s()
    while (since_s := clock.boot_s() - began_s) < mission.duration_s:
        reference = mission.reference(since_s)
        push = np.array([reference.push[0] or 0.0, reference.push[1] or 0.0, 0.0])
        x, y, _ = 1000 * mixer.inputs(push) / GAIN if push.any() else (0.0, 0.0, 0.0)
        sink, turn = reference.nu[2], reference.nu[5] / TURN_RAD_S / GAIN
        dive = math.copysign(DEAD + (1 - DEAD) * abs(sink) / CLIMB_M_S, sink) / GAIN if sink else 0.0
        pilot.sticks = {"x": round(x), "y": round(y), "z": round(500 - 500 * dive), "r": round(1000 * turn)}
        yield
    pilot.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 0.0, 21196.0)
    yield from wait_until(clock, lambda: not pilot.armed, 5.0, "the disarming")
