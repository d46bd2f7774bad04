"""The applet with the firmware in the loop, beside the companion and what ArduSub offers by itself; `pytest -s` prints
figures."""

import math
import sys

import numpy as np
import pytest
from fakes.ardusub import MANUAL
from fakes.firmware import RealTime, firmware_path
from pymavlink.dialects.v20 import ardupilotmega as dialect
from rig import Pilot, arm, ready

from bench.ardusub.firmware import SETTINGS
from bench.ardusub.following import ALONE, BY_FEEDFORWARD, BY_OWN, COMPANIONS, PACE, WIRED, measured
from bridge.ardusub.applet import applet
from bridge.ardusub.dvl import VisionDeltas
from bridge.sensors.samples import DvlSample
from bridge.simulator.json_plant import FOR_SCRIPTS_HZ
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.mode import Mode
from bridge.vehicle.navigation import Navigation
from bridge.vehicle.parameters import set_crc, vehicle_table

pytestmark = pytest.mark.soak
FILE = load_vehicle("bluerov2")
STOPS = 20
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


def launched(folder, script):
    """The firmware with the thrusters on outputs 9 to 14, and a script there from the start."""
    return RealTime(
        folder, settings=WIRED, first_output=9, depth_m=10.0, speedup=PACE, step_hz=FOR_SCRIPTS_HZ,
        files={"scripts/seatrial.lua": script},
    )  # fmt: skip


def made():
    return applet(FILE, "standard", {**SETTINGS, "SCR_ENABLE": 1.0}).text


def afloat(firmware, flight_mode, mode):
    """Armed, with a pilot, a DVL, and the file's own model in force."""
    pilot = Pilot(firmware)
    acts = (pilot, Dvl(firmware))
    ready(firmware, *acts)
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


def test_the_applet_and_the_companion_follow_the_sticks_far_better_than_what_ardusub_offers(tmp_path):
    """A tenth of what sticks alone are off, and a third of what PSC_VELXY_FF is."""
    figures = measured(firmware_path(), tmp_path)
    say(f"{figures}")
    by_way = {words: np.array(off) for words, off in figures["off"].items()}
    own = np.min([by_way[words] for words in BY_OWN], axis=0)
    # A firmware that keeps overrides lets no applet add anything.
    feedforwards = [words for words in BY_FEEDFORWARD if words in by_way]
    assert len(feedforwards) == (len(BY_FEEDFORWARD) if figures["latest_s"] is not None else len(COMPANIONS))
    for words in feedforwards:
        assert (by_way[words] < by_way[ALONE] / 10).all()
        assert (by_way[words] < own / 3).all()


def test_a_script_that_stops_leaves_the_mixers_own_output_each_time(tmp_path):
    firmware = launched(tmp_path / "sitl", made().replace(PLANTED, ORDERED_TO_FAIL))
    try:
        pilot, acts = afloat(firmware, MANUAL, Mode.ALONE)
        firmware.command(dialect.MAV_CMD_SET_MESSAGE_INTERVAL, 36.0, 5000.0)
        if 0.0 in named(pilot, "FF_ENDS"):
            thrusters_follow_the_mixer_alone(firmware, pilot, acts)
            pytest.skip("this firmware keeps overrides for ever, and the script added nothing, as it should")
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
            pilot.of("NAMED_VALUE_FLOAT").clear()
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


def thrusters_follow_the_mixer_alone(firmware, pilot, acts):
    assert pilot.read("FF_MODE") == Mode.OFF
    for stick, pulses in ((300, (1440, 1440, 1560, 1560)), (-300, (1560, 1560, 1440, 1440))):
        pilot.sticks["x"] = stick
        firmware.run(1.0, *acts)
        assert outputs(pilot)[:4] == pytest.approx(pulses, abs=2)


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
