"""How well a vehicle follows the velocity that its sticks ask for: by the sticks alone, by what ArduSub offers itself,
by the companion and by the applet.

All fly the same steps of the sticks in still water, and are held against the same reference: that of the law in Python,
which has the sticks at once. ArduSub's own feed-forward acts in GUIDED, where it gets that reference as its target.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bench.ardusub.firmware import SETTINGS, SPEEDUP, Firmware, SteppedFirmware
from bench.ardusub.flight import GAIN, Aboard, Pilot, vehicle_file
from bridge.ardusub.applet import APPLET, FIRST_OUTPUT, NAME, TICK_S, applet
from bridge.ardusub.companion import companion_file
from bridge.ardusub.handover import Holder
from bridge.ardusub.law import StickLaw
from bridge.ardusub.mixing import mixer_of
from bridge.errors import LinkError
from bridge.firmware.ardusub import ALT_HOLD
from bridge.simulator.json_plant import FOR_SCRIPTS_HZ, json_body
from bridge.simulator.truth import load_truth
from bridge.vehicle.config import VehicleFile, load_vehicle
from bridge.vehicle.mode import Mode
from bridge.vehicle.navigation import Navigation
from bridge.vehicle.parameters import COMMIT, MODE, set_crc, vehicle_table
from bridge.vehicle.thrusters import thrust_curve

DEPTH_M: Final = 10.0
GUIDED: Final = 4
OWN: Final = "PSC_VELXY_FF"
OWN_GAINS: Final = (0.0, 1.0, 3.0)
TARGET_S: Final = 0.04
STEPS: Final = (300, 0, -300, 150, 0)
STEP_S, REST_S, READY_S, WAIT_S, PUT_BACK_S = 3.0, 90.0, 60.0, 20.0, 0.5
ONSET_S: Final = 8.0
"""After arming a feed-forward is faded in; the steps begin with all of it."""
AT_REST_M_S: Final = 5e-3
"""What one way leaves of motion is not the next one's: without thrust a vehicle drifts on for many seconds."""
AXES: Final = ("x", "y")
"""The sticks of surge and sway."""
PACE: Final = 0.5
"""Times real time at which a script has its turns on a loaded computer too."""
WIRED: Final = {
    **SETTINGS,
    **{f"SERVO{FIRST_OUTPUT + n}_FUNCTION": 33.0 + n for n in range(6)},
    "SCR_ENABLE": 1.0,
}
"""The wiring of the applet, which the companion flies with as well."""
VELOCITIES_ALONE: Final = 0b0000_1101_1100_0111


class Afloat:
    """An armed or disarmed vehicle with a pilot, a companion that brings the DVL, and the reference of the sticks."""

    def __init__(self, path: Path, folder: Path, *, script: str = "", speedup: float = SPEEDUP) -> None:
        self._file: VehicleFile = companion_file(load_vehicle(str(vehicle_file(folder))))
        vehicle, configuration = self._file.vehicle, next(iter(self._file.vehicle.configurations))
        truth = load_truth(self._file, configuration).calm()
        if script:
            (folder / "scripts").mkdir(exist_ok=True)
            (folder / "scripts" / NAME).write_text(script, encoding="utf-8")
        body = json_body(
            self._file,
            configuration,
            truth,
            depth_m=DEPTH_M,
            first_output=FIRST_OUTPUT,
            step_hz=FOR_SCRIPTS_HZ,
        )
        self._firmware = SteppedFirmware(Firmware(path, folder, body, WIRED, speedup))
        self._body, self._clock = body, self._firmware.clock
        self._aboard = Aboard(self._firmware.process, self._file, folder / "ring", seed=1)
        self.pilot = Pilot(self._firmware.ground, self._clock)
        shape, curve = (
            vehicle.configurations[configuration],
            thrust_curve(vehicle.thrust_curve, self._file.path.parent),
        )
        self._values = {row.name: row.default for row in vehicle_table(vehicle)}
        model = {row.coefficient: row.default for row in vehicle_table(vehicle) if row.default}
        mixer = mixer_of(WIRED, shape, curve)
        self._law = StickLaw(vehicle, configuration, lambda _: model, self._file.path.parent, mixer)
        self._law_s = self._target_s = 0.0
        self._guides = False

    def close(self) -> None:
        self._firmware.close()

    def begin(self) -> None:
        """Wait until the autopilot, its velocity and the companion are there."""
        self._until(lambda: self.pilot.standing_by, READY_S, "the autopilot's start")
        companion = self._aboard.companion
        # Beside a script it takes no sticks, and need not.
        self._until(
            lambda: companion.law is not None and companion.heard.has_switches(self._clock.boot_s()),
            READY_S,
            "the companion",
        )
        self.run(8.0)

    @property
    def keeps_overrides(self) -> bool:
        """Whether the script has proved that this firmware lets go of no output, and so adds nothing."""
        return self.pilot.named.get("FF_ENDS", [1.0])[-1] == 0.0

    def commit_applet(self) -> None:
        """Put the file's own model in force in the applet."""
        crc = float(set_crc(self._values))
        self.set(APPLET, None)
        self.set(COMMIT, crc)

    def set(self, name: str, value: float | None) -> None:
        """Write a parameter of the autopilot until it echoes; without a value wait until it is there.

        Raises LinkError where it does not come, or where a script puts back what it refuses.
        """

        def there() -> bool:
            if value is not None and self.pilot.parameters.get(name) != value:
                self.pilot.send(dialect.MAVLink_param_set_message(1, 1, name.encode(), value, 9))
            return self._asked(name) and value in (None, self.pilot.parameters[name])

        self.pilot.parameters.pop(name, None)
        self._until(there, WAIT_S, name)
        self.run(PUT_BACK_S)
        self.pilot.parameters.pop(name)
        self._until(lambda: self._asked(name), WAIT_S, name)
        if value not in (None, self.pilot.parameters[name]):
            raise LinkError(f"{name} {value:g} was put back to {self.pilot.parameters[name]:g}")

    def set_companion(self, mode: Mode) -> None:
        refusal = self._aboard.parameters.write(MODE, float(mode), armed=False)
        if refusal is not None:
            raise LinkError(f"FF_MODE {mode.word}: {refusal}")
        holder = Holder.HELD if mode.applies_feedforward else Holder.FREE
        self._until(lambda: self._aboard.companion.handover.holder is holder, WAIT_S, "the sticks")

    def arm(self, flight_mode: int) -> None:
        self.pilot.command(dialect.MAV_CMD_DO_SET_MODE, 1.0, float(flight_mode))
        self._guides = flight_mode == GUIDED
        asked_s = -math.inf

        def armed() -> bool:
            nonlocal asked_s
            if self._clock.boot_s() > asked_s + 1.5:
                asked_s = self._clock.boot_s()
                self.pilot.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1.0, 21196.0)
            return self.pilot.armed

        self._until(armed, WAIT_S, "the arming")

    def disarm(self) -> None:
        self._guides = False
        self.pilot.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 0.0, 21196.0)
        self._until(lambda: not self.pilot.armed, WAIT_S, "the disarming")

    def off_m_s(self, axis: str) -> float:
        """Rms over the steps of a stick of the velocity less the reference, m/s."""
        dof, off = AXES.index(axis), list[float]()
        self.run(ONSET_S)
        self._until(
            lambda: float(np.hypot(*self._body.state[7:9])) < AT_REST_M_S, REST_S, "the rest before the steps"
        )
        for value in STEPS:
            self.pilot.sticks[axis] = value
            self.run(STEP_S, lambda: off.append(self._law.reference_m_s[dof] - self._body.state[7 + dof]))
        return float(np.sqrt(np.mean(np.square(off))))

    def run(self, seconds: float, *acts: Callable[[], object]) -> None:
        self._firmware.run(seconds, self._aboard, self.pilot.step, self._step_law, self._guide, *acts)

    def _until(self, met: Callable[[], object], seconds: float, what: str) -> None:
        acts = (self._aboard, self.pilot.step, self._step_law, self._guide)
        if not self._firmware.until(met, seconds, *acts):
            raise LinkError(f"{what} did not come within {seconds:g} s")

    def _asked(self, name: str) -> bool:
        if name not in self.pilot.parameters:
            self.pilot.send(dialect.MAVLink_param_request_read_message(1, 1, name.encode(), -1))
        return name in self.pilot.parameters

    def _step_law(self) -> None:
        now_s = self._clock.boot_s()
        if now_s >= self._law_s:
            self._law_s = now_s + TICK_S
            sticks = np.array([self.pilot.sticks[axis] for axis in "xyr"], float)
            self._law.step(now_s, sticks, GAIN, Mode.SHADOW, "", ALT_HOLD, Navigation(), ())

    def _guide(self) -> None:
        """Order the reference as GUIDED's target, north and east."""
        now_s = self._clock.boot_s()
        if not self._guides or now_s < self._target_s:
            return
        self._target_s = now_s + TARGET_S
        w, x, y, z = self._body.state[3:7]
        heading = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        u, v = self._law.reference_m_s[:2]
        north, east = (
            u * math.cos(heading) - v * math.sin(heading),
            u * math.sin(heading) + v * math.cos(heading),
        )
        self.pilot.send(
            dialect.MAVLink_set_position_target_local_ned_message(
                0, 1, 1, dialect.MAV_FRAME_LOCAL_NED, VELOCITIES_ALONE, 0, 0, 0, north, east, 0, 0, 0, 0, 0, 0
            )
        )


@dataclass(frozen=True)
class Way:
    """A way to fly: its name, and what makes a disarmed vehicle ready for it."""

    words: str
    ready: Callable[[Afloat], object]
    flight_mode: int = ALT_HOLD


def _own(gain: float) -> Way:
    return Way(f"GUIDED, `{OWN}` {gain:g}", lambda afloat: afloat.set(OWN, gain), GUIDED)


def _companion(mode: Mode, words: str) -> Way:
    return Way(words, lambda afloat: afloat.set_companion(mode))


def _applet(mode: Mode, words: str) -> Way:
    return Way(words, lambda afloat: afloat.set(MODE, float(mode)))


ALONE: Final = "sticks alone"
OWN_WAYS: Final = tuple(map(_own, OWN_GAINS))
COMPANIONS: Final = (
    _companion(Mode.ALONE, "companion, `ff`"),
    _companion(Mode.BOTH, "companion, `both`"),
)
APPLETS: Final = (_applet(Mode.ALONE, "applet, `ff`"), _applet(Mode.BOTH, "applet, `both`"))
WITHOUT_SCRIPT: Final = (_companion(Mode.SHADOW, ALONE), *OWN_WAYS, *COMPANIONS)
WITH_SCRIPT: Final = (_applet(Mode.SHADOW, "sticks alone, the applet in shadow"), *APPLETS)
BY_OWN: Final = tuple(way.words for way in OWN_WAYS)
BY_FEEDFORWARD: Final = tuple(way.words for way in (*COMPANIONS, *APPLETS))


def measured(path: Path, folder: Path) -> dict[str, Any]:
    """By way the rms of the velocity less the reference, m/s, in surge and sway; and after how long the latest of the
    script's ticks came, s, None where the firmware lets no script add anything; and its version. `folder` is made."""
    folder.mkdir(parents=True, exist_ok=True)
    off: dict[str, list[float]] = {}
    latest_ms: list[float] = []
    version = ""
    vehicle = load_vehicle(str(vehicle_file(folder)))
    script = applet(vehicle, next(iter(vehicle.vehicle.configurations)), WIRED).text
    for ways, text, speedup in ((WITHOUT_SCRIPT, "", SPEEDUP), (WITH_SCRIPT, script, PACE)):
        afloat = Afloat(path, folder / ("applet" if text else "stock"), script=text, speedup=speedup)
        try:
            afloat.begin()
            version = afloat.pilot.version
            if text and afloat.keeps_overrides:
                break
            if text:
                afloat.commit_applet()
            for way in ways:
                way.ready(afloat)
                afloat.arm(way.flight_mode)
                afloat.pilot.named.clear()
                off[way.words] = [afloat.off_m_s(axis) for axis in AXES]
                latest_ms += afloat.pilot.named.get("FF_TICK_MS", [])
                afloat.disarm()
                afloat.set_companion(Mode.SHADOW)
        finally:
            afloat.close()
    return {"off": off, "latest_s": 1e-3 * max(latest_ms) if latest_ms else None, "version": version}
