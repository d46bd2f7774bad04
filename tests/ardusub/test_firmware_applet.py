"""Figures of the applet with the firmware in the loop, printed by `pytest -s`; and what ArduSub offers by itself."""

import math
import sys

import numpy as np
import pytest
from fakes.ardusub import ALT_HOLD, MANUAL
from fakes.firmware import RealTime
from pymavlink.dialects.v20 import ardupilotmega as dialect
from rig import Pilot, arm, ready

from bench.ardusub.firmware import SETTINGS
from bridge.ardusub.applet import applet
from bridge.ardusub.dvl import VisionDeltas
from bridge.ardusub.law import StickLaw
from bridge.ardusub.mixing import Mixer
from bridge.sensors.samples import DvlSample
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.mode import Mode
from bridge.vehicle.navigation import Navigation
from bridge.vehicle.parameters import set_crc, vehicle_table
from bridge.vehicle.thrusters import thrust_curve

pytestmark = pytest.mark.soak
FILE = load_vehicle("bluerov2")
SHAPE = FILE.vehicle.configurations["standard"]
GUIDED = 4
STOPS = 20
HOLD_MS = 50.0
BEATS = 25
"""Of the script in 15 s, where it has its turns: fewer, and it stood still for long."""
PACE = 0.4
"""Of the firmware's time: where it runs as fast as a computer can, its main loop leaves scripts too few turns."""
NAN = math.nan
PLANTED = "local now = micros()"
ORDERED_TO_FAIL = f'{PLANTED}\nif ff_version:get() == 99 then error("planted") end'


def say(text):
    sys.stderr.write(f"\n{text}\n")


class Dvl:
    """The body's velocity as VISION_POSITION_DELTA, ten times a second, as another program would send it."""

    def __init__(self, firmware):
        self.firmware, self.deltas, self.due_s = firmware, VisionDeltas(), 0.0

    def __call__(self):
        now_s = self.firmware.body.time_s
        if now_s < self.due_s:
            return
        self.due_s = now_s + 0.1
        velocity, rate = (tuple(self.firmware.body.state[i : i + 3].tolist()) for i in (7, 10))
        sample = DvlSample(now_s, velocity, NAN, 3.0)
        for message in self.deltas.take(sample, Navigation(velocity, now_s, rate, now_s)):
            self.firmware.ground.write(self.firmware.own.encode(message))


class Asked:
    """The velocity that the sticks ask for, by the law in Python, on the body's clock."""

    def __init__(self, firmware, pilot):
        curve = thrust_curve(FILE.vehicle.thrust_curve, FILE.path.parent)
        mixer = Mixer(1, (1.0,) * 6, SHAPE, curve)
        model = {row.coefficient: row.default for row in vehicle_table(FILE.vehicle) if row.default}
        self.law = StickLaw(FILE.vehicle, "standard", lambda _: model, FILE.path.parent, mixer)
        self.firmware, self.pilot, self.due_s = firmware, pilot, 0.0

    def __call__(self):
        now_s = self.firmware.body.time_s
        if now_s >= self.due_s:
            self.due_s = now_s + 0.01
            sticks = np.array([self.pilot.sticks[axis] for axis in "xyr"], float)
            self.law.step(now_s, sticks, 0.5, Mode.SHADOW, "", ALT_HOLD, Navigation(), ())

    @property
    def velocity(self):
        return self.law.reference_m_s


class Guide:
    """Orders the velocity that the sticks ask for in GUIDED, 25 times a second, and flies no sticks."""

    def __init__(self, firmware, asked):
        self.firmware, self.asked, self.due_s = firmware, asked, 0.0

    def __call__(self):
        now_s = self.firmware.body.time_s
        if now_s < self.due_s:
            return
        self.due_s = now_s + 0.04
        w, x, y, z = self.firmware.body.state[3:7]
        heading = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        u, v = self.asked.velocity[:2]
        north, east = (
            u * math.cos(heading) - v * math.sin(heading),
            u * math.sin(heading) + v * math.cos(heading),
        )
        velocities_alone = 0b0000_1101_1100_0111
        self.firmware.ground.write(
            self.firmware.own.encode(
                dialect.MAVLink_set_position_target_local_ned_message(
                    0, 1, 1, dialect.MAV_FRAME_LOCAL_NED, velocities_alone,
                    0, 0, 0, north, east, 0, 0, 0, 0, 0, 0,
                )
            )
        )  # fmt: skip


def launched(folder, script=None, speedup=PACE, **settings):
    """The firmware with the thrusters on outputs 9 to 14, and a script there from the start."""
    wiring = {f"SERVO{8 + n}_FUNCTION": 32 + n for n in range(1, 7)}
    return RealTime(
        folder, settings={**wiring, "SCR_ENABLE": 1, **settings}, first_output=9, depth_m=10.0, speedup=speedup,
        files={} if script is None else {"scripts/seatrial.lua": script},
    )  # fmt: skip


def made():
    return applet(FILE, "standard", {**SETTINGS, "SCR_ENABLE": 1.0}).text


def afloat(firmware, flight_mode, mode=None):
    """Armed, with a pilot, a DVL, and the file's own model in force where a script runs."""
    pilot = Pilot(firmware)
    acts = (pilot, Dvl(firmware))
    ready(firmware, *acts)
    if mode is not None:
        values = {row.name: row.default for row in vehicle_table(FILE.vehicle)}
        assert firmware.until(lambda: pilot.read("FF_APPLET"), 20.0, *acts)
        pilot.write("FF_COMMIT", float(set_crc(values)))
        assert firmware.until(lambda: pilot.read("FF_ACTIVE") == set_crc(values), 10.0, *acts)
        pilot.write("FF_MODE", float(mode))
        assert firmware.until(lambda: pilot.read("FF_MODE") == mode, 10.0, *acts)
    firmware.run(8.0, *acts)
    firmware.set_mode(flight_mode)
    arm(firmware, *acts)
    return pilot, acts


def followed_mm_s(firmware, pilot, acts, asked, axis, dof):
    """Rms of the body's velocity minus the reference over steps of a stick, mm/s."""
    off = []

    def look():
        off.append(asked.velocity[dof] - firmware.body.state[7 + dof])

    for value in (300, 0, -300, 150, 0):
        pilot.sticks[axis] = value
        firmware.run(3.0, *acts, asked, look)
    return 1e3 * float(np.sqrt(np.mean(np.square(off))))


@pytest.mark.parametrize(("axis", "dof"), [("x", 0), ("y", 1)])
def test_the_applet_follows_the_sticks_reference_several_times_better_than_sticks_alone(tmp_path, axis, dof):
    firmware = launched(tmp_path / "sitl", made())
    try:
        pilot, acts = afloat(firmware, ALT_HOLD, Mode.SHADOW)
        errors_mm_s, latest = {}, []
        for mode in (Mode.SHADOW, Mode.ALONE, Mode.BOTH):
            if mode is not Mode.SHADOW:
                # Armed, shadow would have to be flown for a minute first.
                firmware.arm(False)
                assert firmware.until(lambda: not pilot.sees_armed(), 10.0, *acts)
                pilot.write("FF_MODE", float(mode))
                assert firmware.until(lambda: pilot.read("FF_MODE") == mode, 10.0, *acts)  # noqa: B023
                arm(firmware, *acts)
            firmware.run(4.0, *acts)
            pilot.heard.clear()
            errors_mm_s[mode] = followed_mm_s(firmware, pilot, acts, Asked(firmware, pilot), axis, dof)
            ticks_ms = named(pilot, "FF_TICK_MS")
            latest.append(max(ticks_ms) if len(ticks_ms) >= BEATS else math.inf)
        words = ", ".join(f"{mode.word} {value:.1f} mm/s" for mode, value in errors_mm_s.items())
        say(f"applet, {axis}: {words}; its latest tick came after {max(latest):.0f} ms")
        if max(latest) > HOLD_MS:
            pytest.skip(
                "the simulator left the script no turns for longer than an override lasts: no measure of it"
            )
        assert errors_mm_s[Mode.ALONE] < errors_mm_s[Mode.SHADOW] / 5
        assert errors_mm_s[Mode.BOTH] < errors_mm_s[Mode.SHADOW] / 5
    finally:
        firmware.close()


@pytest.mark.parametrize(("axis", "dof"), [("x", 0), ("y", 1)])
def test_what_ardusub_offers_by_itself_on_the_same_reference(tmp_path, axis, dof):
    firmware = launched(tmp_path / "sitl", speedup=0.9, SCR_ENABLE=0)
    try:
        pilot, acts = afloat(firmware, GUIDED)
        errors_mm_s = {}
        for gain in (0.0, 1.0, 3.0):
            pilot.write("PSC_VELXY_FF", gain)
            assert firmware.until(lambda: pilot.read("PSC_VELXY_FF") == gain, 10.0, *acts)  # noqa: B023
            firmware.set_mode(GUIDED)
            asked = Asked(firmware, pilot)
            guide = Guide(firmware, asked)
            firmware.run(4.0, *acts, asked, guide)
            assert pilot.beats_of_autopilot()[-1].custom_mode == GUIDED
            errors_mm_s[gain] = followed_mm_s(firmware, pilot, (*acts, guide), asked, axis, dof)
        say(
            f"GUIDED, {axis}: "
            + ", ".join(f"PSC_VELXY_FF {k:g} {v:.1f} mm/s" for k, v in errors_mm_s.items())
        )
        assert all(value > 20.0 for value in errors_mm_s.values())
    finally:
        firmware.close()


def test_a_script_that_stops_leaves_the_mixers_own_output_each_time(tmp_path):
    firmware = launched(tmp_path / "sitl", made().replace(PLANTED, ORDERED_TO_FAIL), speedup=0.6)
    try:
        pilot, acts = afloat(firmware, MANUAL, Mode.ALONE)
        firmware.command(dialect.MAV_CMD_SET_MESSAGE_INTERVAL, 36.0, 5000.0)
        took_ms, kept_up = [], []
        for number in range(STOPS):
            assert firmware.until(lambda: beats(pilot), 10.0, *acts)
            # The other way each time, so that the feed-forward has something to add just then.
            pilot.sticks["x"] = 300 if number % 2 else -300
            assert firmware.until(lambda: added(pilot), 2.0, *acts)
            pilot.heard.clear()
            stopped_s = firmware.body.time_s
            if number % 2:
                pilot.write("FF_VERSION", 99.0)
            else:
                firmware.command(dialect.MAV_CMD_SCRIPTING, 2.0)
            seen = []

            def look(seen=seen):
                seen.append((firmware.body.time_s, added(pilot)))

            firmware.run(0.3, *acts, look)
            pilot.heard = pilot.of("SERVO_OUTPUT_RAW")
            firmware.run(0.7, *acts, look)
            last_s = max((at_s for at_s, more in seen if more), default=stopped_s)
            took_ms.append(1e3 * (last_s - stopped_s))
            kept_up.append(not seen[-1][1])
            assert not beats(pilot)
            # Started again it proves itself, disarmed, before it adds anything.
            firmware.arm(False)
            pilot.write("FF_VERSION", 1.0)
            firmware.run(0.3, *acts)
            assert set(outputs(pilot)) == {1500}
            firmware.command(dialect.MAV_CMD_SCRIPTING, 3.0)
            assert firmware.until(lambda: named(pilot, "FF_ENDS"), 10.0, *acts)
            arm(firmware, *acts)
        say(
            f"script stopped or failed {STOPS} times, mixer's own output back {sum(kept_up)} times, "
            f"{min(took_ms):.0f} to {max(took_ms):.0f} ms after the order"
        )
        assert all(kept_up)
        assert max(took_ms) < 500
    finally:
        firmware.close()


def outputs(pilot):
    newest = pilot.of("SERVO_OUTPUT_RAW")[-1]
    return [getattr(newest, f"servo{n}_raw") for n in range(9, 15)]


def added(pilot):
    """Whether the thrusters get something else than the mixer gives, by the newest SERVO_OUTPUT_RAW."""
    if not pilot.of("SERVO_OUTPUT_RAW"):
        return False
    newest = pilot.of("SERVO_OUTPUT_RAW")[-1]
    mixer = [getattr(newest, f"servo{n}_raw") for n in range(1, 7)]
    return max(abs(a - b) for a, b in zip(outputs(pilot), mixer, strict=True)) > 5


def beats(pilot):
    """The script's beats among what was heard."""
    return named(pilot, "FF_MODE")


def named(pilot, name):
    return [m.value for m in pilot.of("NAMED_VALUE_FLOAT") if m.name == name]
