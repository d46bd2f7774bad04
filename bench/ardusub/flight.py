"""A plan flown by sticks in ArduSub's ALT_HOLD, recorded by the companion beside it: a dive of the real firmware."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bench.ardusub.firmware import SETTINGS, BodyClock, Firmware, Script, wait_until
from bridge.ardusub.companion import Companion, companion_file
from bridge.ardusub.mixing import Mixer
from bridge.arrays import Array
from bridge.firmware.ardusub import ALT_HOLD
from bridge.links.link import Link
from bridge.onboard.orders import Ground
from bridge.onboard.parameters import ParameterServer
from bridge.onboard.ring import RingSize, ring_in
from bridge.onboard.service import Bridge
from bridge.sensors.samples import DvlSample
from bridge.simulator.json_plant import json_body
from bridge.simulator.missions import Mission
from bridge.simulator.truth import NoiseLevels, Truth
from bridge.vehicle.coefficients import DAMPINGS, QUADRATICS
from bridge.vehicle.config import VehicleFile, load_vehicle
from bridge.vehicle.parameters import COMMIT, vehicle_table
from bridge.vehicle.references import Reference
from bridge.vehicle.thrusters import thrust_curve
from bridge.wire.framing import Encoder, Framer, decode
from gcs_plugin.asking import command_long

VEHICLE: Final = "bluerov2"
DEPTH_M: Final = 8.0
AUTOPILOT: Final = 1
STICKS_S, DVL_S, BEAT_S, DISK_S = 0.04, 0.1, 1.0, 0.5
GAIN: Final = SETTINGS["JS_GAIN_DEFAULT"]
TURN_RAD_S: Final = math.radians(202.5)
"""Rate that a full stick asks for at a gain of 1 in ALT_HOLD: 45 degrees times ACRO_YAW_P."""
CLIMB_M_S, DEAD = 5.0, 0.2
"""Likewise up and down, PILOT_SPEED_UP, beyond the share of the stick that is THR_DZ's."""
RING: Final = RingSize(1 << 30, 1 << 30)


SEA_KG_M3: Final = 1024.0
"""Density of the water in ArduSub's simulated barometer (libraries/AP_Baro/AP_Baro_HIL.cpp)."""


def vehicle_file(folder: Path) -> Path:
    """The BlueROV2 of configs with a Water Linked A50 on it, in the sea, as a file in `folder`, which is made."""
    folder.mkdir(parents=True, exist_ok=True)
    out = folder / f"{VEHICLE}.yaml"
    bundled = load_vehicle(VEHICLE).path.read_text(encoding="utf-8")
    more = f"\nwater: {{density_kg_m3: {SEA_KG_M3:g}}}\nsensors: {{dvl: {{kind: a50}}}}\nthrust_curve:"
    out.write_text(bundled.replace("\nthrust_curve:", more), encoding="utf-8")
    return out


KINDS: Final = {0: "-dev", 64: "-alpha", 128: "-beta", 192: "-rc", 255: ""}
"""FIRMWARE_VERSION_TYPE of the last byte; a later one of a kind counts on from it."""


def version_of(number: int) -> str:
    """The version in AUTOPILOT_VERSION's flight_sw_version: major, minor and patch, a byte each, and the kind."""
    major, minor, patch, kind = number.to_bytes(4, "big")
    least = max(each for each in KINDS if each <= kind)
    return f"{major}.{minor}.{patch}{KINDS[least]}{kind - least or ''}"


class Pilot:
    """A ground station with a joystick: beats, and sends its sticks 25 times a second; none where `sticks` is empty.

    It keeps what the autopilot said: its `parameters`, all values of each `named` one, and its `version`.
    """

    def __init__(self, link: Link, clock: BodyClock) -> None:
        self._link, self._clock = link, clock
        self._encoder, self._framer = Encoder(255, 190), Framer()
        self.sticks = {"x": 0, "y": 0, "z": 500, "r": 0}
        self._beat_s = self._sticks_s = 0.0
        self._kept = {
            dialect.MAVLINK_MSG_ID_PARAM_VALUE: self._parameter,
            dialect.MAVLINK_MSG_ID_NAMED_VALUE_FLOAT: self._named,
            dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION: self._versioned,
        }
        self.standing_by = self.armed = False
        self.version = ""
        self.parameters: dict[str, float] = {}
        self.named: dict[str, list[float]] = {}

    def step(self) -> None:
        now_s = self._clock.boot_s()
        if now_s >= self._beat_s:
            self._beat_s = now_s + BEAT_S
            self.send(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
            if self.standing_by and not self.version:
                wanted = float(dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
                self.command(dialect.MAV_CMD_REQUEST_MESSAGE, wanted)
        if self.sticks and now_s >= self._sticks_s:
            self._sticks_s = now_s + STICKS_S
            self.send(dialect.MAVLink_manual_control_message(1, **self.sticks, buttons=0))
        while data := self._link.read(0.0):
            for frame in self._framer.feed(data):
                if frame.message_id == dialect.MAVLINK_MSG_ID_HEARTBEAT and frame.component == 1:
                    self._heartbeat(decode(frame))
                elif frame.message_id in self._kept and (message := decode(frame)) is not None:
                    self._kept[frame.message_id](message)

    def send(self, message: Any) -> None:
        self._link.write(self._encoder.encode(message))

    def command(self, number: int, *parameters: float) -> None:
        self.send(command_long((1, AUTOPILOT), number, *parameters))

    def _versioned(self, message: Any) -> None:
        if message.get_srcComponent() == AUTOPILOT:
            self.version = version_of(message.flight_sw_version)

    def _parameter(self, message: Any) -> None:
        if message.get_srcComponent() == AUTOPILOT:
            self.parameters[message.param_id] = message.param_value

    def _named(self, message: Any) -> None:
        self.named.setdefault(message.name, []).append(message.value)

    def _heartbeat(self, beat: Any) -> None:
        if beat is not None:
            self.standing_by = beat.system_status >= dialect.MAV_STATE_STANDBY
            self.armed = bool(beat.base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED)


class Aboard:
    """The companion's computer, with a DVL of the body's velocity and a recording in `ring`; a call is a tick."""

    def __init__(self, firmware: Firmware, file: VehicleFile, ring: Path, seed: int) -> None:
        self._body, self._clock, self._ring = (
            firmware.body,
            firmware.clock,
            ring_in(ring, RING, firmware.clock),
        )
        self._folder = ring
        configuration = next(iter(file.vehicle.configurations))
        self.parameters = ParameterServer(None, vehicle_table(file.vehicle), component=191)
        self.parameters.write(COMMIT, float(self.parameters.staged_crc), armed=False)
        self.companion = Companion(file, configuration, self.parameters, Ground(), None)
        self._bridge = Bridge(
            file.vehicle,
            firmware.clock,
            [firmware.aboard],
            self.parameters,
            companion=self.companion,
            ring=self._ring,
        )
        self._noise, self._dvl_m_s = np.random.default_rng(seed), NoiseLevels().dvl_m_s
        self._dvl_s = self._disk_s = 0.0

    def __call__(self) -> None:
        now_s = self._clock.boot_s()
        if now_s >= self._dvl_s:
            self._dvl_s = now_s + DVL_S
            velocity = (self._body.state[7:10] + self._dvl_m_s * self._noise.standard_normal(3)).tolist()
            self._bridge.accept("dvl", (DvlSample(now_s, tuple(velocity), math.nan, 20.0),))
        if now_s >= self._disk_s:
            self._disk_s = now_s + DISK_S
            self._ring.write_waiting()
        self._bridge.step()

    def recording(self) -> Path:
        self._ring.write_waiting()
        self._ring.close()
        (recording,) = self._folder.iterdir()
        return recording


@dataclass(frozen=True)
class Flown:
    """What a flight left: the companion's recording, and the firmware's version."""

    recording: Path
    version: str


def fly(
    path: Path,
    folder: Path,
    mission: Mission,
    truth: Truth,
    *,
    settings: Mapping[str, float] = SETTINGS,
    seed: int = 1,
    depth_m: float = DEPTH_M,
) -> Flown:
    """Fly a mission of pushes and rates with the firmware at `path`, the body being `truth`.

    `folder` is made; the recording lies in it. Raises LinkError where the firmware does not do its part.
    """
    file = companion_file(load_vehicle(str(vehicle_file(folder))))
    configuration = next(iter(file.vehicle.configurations))
    firmware = Firmware(
        path, folder, json_body(file, configuration, truth, seed=seed, depth_m=depth_m), settings
    )
    try:
        aboard, pilot = Aboard(firmware, file, folder / "ring", seed), Pilot(firmware.ground, firmware.clock)

        def act() -> None:
            aboard()
            pilot.step()

        shape = file.vehicle.configurations[configuration]
        curve = thrust_curve(file.vehicle.thrust_curve, file.path.parent)
        mixer = Mixer(int(settings["FRAME_CONFIG"]), (1.0,) * len(shape.thrusters), shape, curve)
        pushed = partial(push_of, shape.model)
        firmware.fly(_with(act, _flight(firmware.clock, aboard.companion, pilot, mixer, mission, pushed)))
        return Flown(aboard.recording(), pilot.version)
    finally:
        firmware.close()


def _with(act: Any, script: Script) -> Script:
    for _ in script:
        act()
        yield


def push_of(model: Mapping[str, float], reference: Reference) -> Array:
    """The push ahead, aside and about (3,) that a pilot gives for a reference: in surge and sway its own, or else that
    which keeps the velocity against the drag of `model`; the turn is the autopilot's."""
    out = np.zeros(3)
    for dof in range(2):
        speed = reference.nu[dof]
        drag = model[DAMPINGS[dof].name] + model[QUADRATICS[dof].name] * abs(speed)
        push = reference.push[dof]
        out[dof] = drag * speed if push is None else push
    return out


def _flight(
    clock: BodyClock,
    companion: Companion,
    pilot: Pilot,
    mixer: Mixer,
    mission: Mission,
    pushed: Callable[[Reference], Array],
) -> Script:
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
        push = pushed(reference)
        x, y, _ = 1000 * mixer.inputs(push) / GAIN if push.any() else (0.0, 0.0, 0.0)
        sink, turn = reference.nu[2], reference.nu[5] / TURN_RAD_S / GAIN
        dive = math.copysign(DEAD + (1 - DEAD) * abs(sink) / CLIMB_M_S, sink) / GAIN if sink else 0.0
        pilot.sticks = {"x": round(x), "y": round(y), "z": round(500 - 500 * dive), "r": round(1000 * turn)}
        yield
    pilot.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 0.0, 21196.0)
    yield from wait_until(clock, lambda: not pilot.armed, 5.0, "the disarming")
