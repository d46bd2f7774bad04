"""The real ArduSub as a process, the simulated BlueROV2 as its body: for `SEATRIAL_ARDUSUB=/path/to/ardusub`.

It has the words of the fake, `fakes.ardusub.Ardusub`: two links, `run`, `until`, `arm`, `set_mode`. Time is the body's,
which runs as fast as the computer can, and not at all between two calls; `RealTime` is for a test that starts another
program beside it.
"""

import time
from dataclasses import replace

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bench.ardusub import firmware
from bench.ardusub.firmware import SETTINGS, SPEEDUP, WHY_NOT, SteppedFirmware
from bridge.clock import SystemClock
from bridge.simulator.json_plant import STEP_HZ, json_body
from bridge.simulator.truth import load_truth
from bridge.vehicle.config import load_vehicle
from bridge.wire.framing import Encoder


def firmware_path():
    """The firmware; a test that needs it is skipped where none is named."""
    path = firmware.firmware_path()
    if path is None:
        pytest.skip(WHY_NOT)
    return path


class Firmware(SteppedFirmware):
    """`ardusub --model JSON` in `folder`, with its own parameters; `settings` adds to SETTINGS.

    Scripts get their turns at a body of finer steps, on a loaded computer at a small `speedup` too. `files` are in the
    folder from the start, by name.
    """

    is_firmware = True

    def __init__(
        self, folder, vehicle="bluerov2", settings=None, planted=None, depth_m=5.0, first_output=1, files=None,
        speedup=SPEEDUP, step_hz=STEP_HZ,
    ):  # fmt: skip
        path = firmware_path()
        for name, text in (files or {}).items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(text, encoding="utf-8")
        file = load_vehicle(vehicle)
        configuration = next(iter(file.vehicle.configurations))
        truth = replace(load_truth(file, configuration).calm(), onset=planted or {})
        self.body = json_body(
            file, configuration, truth, depth_m=depth_m, first_output=first_output, step_hz=step_hz
        )
        self.own = Encoder(255, 190)
        super().__init__(
            firmware.Firmware(path, folder, self.body, {**SETTINGS, **(settings or {})}, speedup)
        )

    def command(self, number, *parameters):
        filled = (*parameters, *(0,) * (7 - len(parameters)))
        self.ground.write(self.own.encode(dialect.MAVLink_command_long_message(1, 1, number, 0, *filled)))

    def arm(self, wanted=True):
        self.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, float(wanted), 21196.0)

    def set_mode(self, mode):
        self.command(dialect.MAV_CMD_DO_SET_MODE, 1.0, float(mode))


class RealTime(Firmware):
    """No faster than real time, which goes on between two calls; slower at a `speedup` below 1, by the body's time."""

    def __init__(self, folder, speedup=1, **options):
        super().__init__(folder, speedup=speedup, **options)
        if speedup == 1:
            self.clock = SystemClock()

    def begin(self):
        pass

    def until(self, met, seconds, *acts):
        until_s = self.clock.boot_s() + seconds
        while not (result := met()) and self.clock.boot_s() < until_s:
            for act in acts:
                act()
            time.sleep(0.002)
        return result
