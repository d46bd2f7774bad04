"""The real ArduSub as a process, the simulated BlueROV2 as its body: for `SEATRIAL_ARDUSUB=/path/to/ardusub`.

It has the words of the fake, `fakes.ardusub.Ardusub`: two links, `run`, `until`, `arm`, `set_mode`.
"""

import threading
import time

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bench.ardusub import firmware
from bench.ardusub.firmware import SETTINGS, WHY_NOT, BodyClock, free_instance, launched, reached
from bridge.clock import SystemClock
from bridge.simulator.json_plant import PORT, json_body, serve
from bridge.simulator.truth import load_truth
from bridge.vehicle.config import load_vehicle
from bridge.wire.framing import Encoder


def binary():
    """The firmware; a test that needs it is skipped where none is named."""
    path = firmware.binary()
    if path is None:
        pytest.skip(WHY_NOT)
    return path


class Firmware:
    """`ardusub --model JSON` in `folder`, with its own parameters; `settings` overrides SETTINGS.

    At a `pace` below 1 its time, which is then the clock, passes slower than a computer's: on a loaded one its scripts
    get their turns all the same. `files` are in the folder from the start, by name.
    """

    is_firmware = True

    def __init__(
        self, folder, vehicle="bluerov2", settings=None, current_m_s=(0.0, 0.0, 0.0), depth_m=5.0,
        first_output=1, files=None, pace=1.0,
    ):  # fmt: skip
        path = binary()
        folder.mkdir()
        for name, text in (files or {}).items():
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).write_text(text, encoding="utf-8")
        file = load_vehicle(vehicle)
        configuration = next(iter(file.vehicle.configurations))
        truth = load_truth(file, configuration).calm()
        self.body = json_body(
            file, configuration, truth, depth_m=depth_m, current_m_s=current_m_s, first_output=first_output
        )
        number = free_instance()
        self.stop = threading.Event()
        self.physics = threading.Thread(
            target=serve, args=(self.body, PORT + 10 * number, self.stop), daemon=True
        )
        self.physics.start()
        base = 5760 + 10 * number
        self.process = launched(path, folder, number, {**SETTINGS, **(settings or {})}, pace)
        self.clock = SystemClock() if pace == 1.0 else BodyClock(self.body)
        self.ground, self.aboard = (reached(f"tcp:127.0.0.1:{base + 2 * n}") for n in range(2))
        self.own = Encoder(255, 190)

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
        self.stop.set()
        self.physics.join(10.0)
        self.ground.close()
        self.aboard.close()
