"""The companion as a crew starts it, `seatrial-bridge` as a process of its own, beside the firmware."""

import signal
import subprocess
import sys
from pathlib import Path

from fakes.ardusub import MANUAL
from fakes.firmware import RealTime
from rig import Pilot

from bridge.vehicle.config import load_vehicle
from bridge.vehicle.parameters import set_crc, vehicle_table

CHECKOUT = Path(__file__).resolve().parents[2]


def test_stopped_under_way_the_program_gives_the_sticks_back_and_the_vehicle_stays_armed(tmp_path):
    firmware = RealTime(tmp_path / "sitl")
    firmware.aboard.close()
    options = ["--link", firmware.aboard.name, "--parameters", str(tmp_path / "p.json")]
    program = subprocess.Popen(
        [sys.executable, "-m", "tui", "bridge", "--ardusub", "--vehicle", "bluerov2", *options],
        cwd=CHECKOUT,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        pilot = Pilot(firmware)
        there = lambda: [m for m in pilot.of("HEARTBEAT") if m.get_srcComponent() == 191]  # noqa: E731
        assert firmware.until(there, 30.0, pilot)
        firmware.run(6.0, pilot)
        staged = {row.name: row.default for row in vehicle_table(load_vehicle("bluerov2").vehicle)}
        pilot.write("FF_COMMIT", float(set_crc(staged)), component=191)
        pilot.write("FF_MODE", 2.0, component=191)
        assert firmware.until(lambda: "companion holds the sticks" in pilot.texts(), 20.0, pilot)
        assert pilot.read("SYSID_MYGCS") == 1
        firmware.set_mode(MANUAL)
        firmware.arm()
        pilot.sticks["x"] = 300
        firmware.run(4.0, pilot)
        program.send_signal(signal.SIGINT)
        assert firmware.until(lambda: program.poll() is not None, 10.0, pilot)
        assert program.returncode == 0
        assert pilot.read("SYSID_MYGCS") == 255
        pilot.heard.clear()
        firmware.run(4.0, pilot)
        beats = [m for m in pilot.of("HEARTBEAT") if m.get_srcComponent() == 1]
        assert beats
        assert all(m.base_mode & 128 for m in beats)
    finally:
        program.kill()
        program.wait()
        firmware.close()
