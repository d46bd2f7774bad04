"""The real ArduSub as a process, the simulated BlueROV2 as its body: for `SEATRIAL_ARDUSUB=/path/to/ardusub`.

It has the words of the fake, `fakes.ardusub.Ardusub`: two links, `run`, `until`, `arm`, `set_mode`.
"""

import os
import socket
import subprocess
import threading
import time
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SystemClock
from bridge.errors import LinkError
from bridge.links.open import open_link
from bridge.simulator.json_plant import json_body, serve
from bridge.simulator.truth import load_truth
from bridge.vehicle.config import load_vehicle
from bridge.wire.framing import Encoder

VARIABLE = "SEATRIAL_ARDUSUB"
START_S = 60.0
SETTINGS = {
    "FRAME_CONFIG": 1, "ARMING_CHECK": 0, "BRD_OPTIONS": 0, "SYSID_MYGCS": 255, "FS_GCS_ENABLE": 2,
    "FS_PILOT_INPUT": 2, "JS_GAIN_DEFAULT": 0.5, "VISO_TYPE": 1, "EK3_SRC1_POSXY": 0, "EK3_SRC1_VELXY": 6,
    "EK3_SRC1_POSZ": 1, "EK3_SRC1_VELZ": 0, "EK3_SRC1_YAW": 1, "GPS_TYPE": 0, "SIM_GPS_DISABLE": 1,
    "SIM_BARO_RND": 0.0, "SERVO1_FUNCTION": 33, "SERVO2_FUNCTION": 34, "SERVO3_FUNCTION": 35,
    "SERVO4_FUNCTION": 36, "SERVO5_FUNCTION": 37, "SERVO6_FUNCTION": 38, "LOG_DISARMED": 0, "MOT_FV_CPLNG_K": 0,
}  # fmt: skip


def binary() -> Path:
    """The firmware; a test that needs it is skipped where none is named."""
    if not os.environ.get(VARIABLE):
        pytest.skip(f"needs {VARIABLE}=/path/to/ardusub, a simulated ArduSub")
    path = Path(os.environ[VARIABLE])
    assert path.is_file(), f"{VARIABLE}={path}: no such file"
    return path


def free_port(first, step, kind):
    """The least instance number whose port is free."""
    for number in range(20):
        with socket.socket(socket.AF_INET, kind) as probe:
            try:
                probe.bind(("127.0.0.1", first + step * number))
            except OSError:
                continue
            return number
    raise AssertionError("no port is free")


class Firmware:
    """`ardusub --model JSON` in `folder`, with its own parameters; `settings` overrides SETTINGS."""

    is_firmware = True

    def __init__(self, folder, vehicle="bluerov2", settings=None, current_m_s=(0.0, 0.0, 0.0), depth_m=5.0):
        path = binary()
        folder.mkdir()
        lines = [f"{name} {value}" for name, value in {**SETTINGS, **(settings or {})}.items()]
        (folder / "defaults.parm").write_text("\n".join(lines) + "\n")
        file = load_vehicle(vehicle)
        configuration = next(iter(file.vehicle.configurations))
        truth = load_truth(file, configuration).calm()
        self.body = json_body(file, configuration, truth, depth_m=depth_m, current_m_s=current_m_s)
        number = free_port(9002, 10, socket.SOCK_DGRAM)
        self.stop = threading.Event()
        self.physics = threading.Thread(
            target=serve, args=(self.body, 9002 + 10 * number, self.stop), daemon=True
        )
        self.physics.start()
        base = 5760 + 10 * number
        self.log = (folder / "out.txt").open("w")
        self.process = subprocess.Popen(
            [
                str(path), "--model", "JSON:127.0.0.1", "-I", str(number), "--wipe",
                "--defaults", "defaults.parm", "--home", "33.81,-118.39,0,0", "--rate", "400",
                "--serial0", "tcp:0:nowait", "--serial1", "tcp:2:nowait",
            ],
            cwd=folder,
            stdout=self.log,
            stderr=subprocess.STDOUT,
            stdin=subprocess.DEVNULL,
        )  # fmt: skip
        self.clock = SystemClock()
        self.ground, self.aboard = (self.reached(f"tcp:127.0.0.1:{base + 2 * n}") for n in range(2))
        self.own = Encoder(255, 190)

    def reached(self, spec):
        for _ in range(round(START_S / 0.1)):
            try:
                return open_link(spec)
            except LinkError:
                time.sleep(0.1)
        raise AssertionError(f"{spec}: the firmware did not start")

    def run(self, seconds, *acts):
        until_s = self.clock.boot_s() + seconds
        while self.clock.boot_s() < until_s:
            for act in acts:
                act()
            time.sleep(0.002)

    def until(self, found, seconds, *acts):
        until_s = self.clock.boot_s() + seconds
        while self.clock.boot_s() < until_s:
            if result := found():
                return result
            for act in acts:
                act()
            time.sleep(0.002)
        return found()

    def command(self, number, *parameters):
        filled = (*parameters, *(0,) * (7 - len(parameters)))
        self.ground.write(self.own.encode(dialect.MAVLink_command_long_message(1, 1, number, 0, *filled)))

    def arm(self, wanted=True):
        self.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, float(wanted), 21196.0)

    def set_mode(self, mode):
        self.command(dialect.MAV_CMD_DO_SET_MODE, 1.0, float(mode))

    def close(self):
        self.process.kill()
        self.process.wait()
        self.log.close()
        self.stop.set()
        self.physics.join(10.0)
        self.ground.close()
        self.aboard.close()
