"""A vehicle that turns, recorded by two recorders with clocks of their own: a `.tlog` and a `.BIN`."""

import struct
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, Final

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mav

from bridge.wire.framing import Encoder

UNIX_S: Final = 1_790_000_000.0
FORMATS: Final = {
    "ATT": ("QccC", "TimeUS,Roll,Pitch,Yaw"),
    "IMU": ("QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ"),
    "RCOU": ("QHHHH", "TimeUS,C1,C2,C3,C4"),
    "PARM": ("QNf", "TimeUS,Name,Value"),
    "CTUN": ("Qf", "TimeUS,Alt"),
    "BARO": ("QBf", "TimeUS,I,Press"),
}
"""Letters and columns of the records of a `.BIN`."""
PACKED: Final = {"c": "h", "C": "H", "L": "i", "N": "16s", "n": "4s", "Z": "64s"}
"""How a value is packed where its letter in a log is not Python's."""
LATE_S: Final = 2**0.5 / (2 * np.pi * 20.0)
"""Delay of ArduPilot's low-pass filter of the gyro at its usual corner, 20 Hz."""


def dataflash(formats: dict[str, tuple[str, str]], records: Iterable[tuple[Any, ...]]) -> bytes:
    """A `.BIN` of these formats and records, each a name and its values."""
    data, kinds = bytearray(), {}
    for kind, (name, (letters, columns)) in enumerate(formats.items(), 1):
        layout = struct.Struct("<3B" + "".join(PACKED.get(letter, letter) for letter in letters))
        words = (word.encode() for word in (name, letters, columns))
        data += struct.pack("<5B4s16s64s", 0xA3, 0x95, 0x80, kind, layout.size, *words)
        kinds[name] = kind, layout
    for name, *values in records:
        kind, layout = kinds[name]
        data += layout.pack(0xA3, 0x95, kind, *values)
    return bytes(data)


class Turning:
    """Yaw about which it turns, in rad at times of its own; `seed` is the dive."""

    def __init__(self, seed: int = 0) -> None:
        rng = np.random.default_rng(seed)
        self._rates, self._phases = rng.uniform(0.15, 1.5, 12), rng.uniform(0.0, 2 * np.pi, 12)

    def rate_rad_s(self, time_s: Any) -> Any:
        angles = np.multiply.outer(np.asarray(time_s), self._rates) + self._phases
        return (0.15 * np.cos(angles)).sum(axis=-1)

    def pwm_us(self, time_s: Any) -> Any:
        return np.round(1500 + 150 * self.rate_rad_s(time_s)).astype(int)


def heard(
    path: Path,
    turning: Turning,
    seconds: float = 300.0,
    pwm_hz: float = 2.0,
    component: int = 191,
    autopilot: int = mav.MAV_AUTOPILOT_INVALID,
    system: int = 1,
) -> Path:
    """A `.tlog` from boot second 100 on: rates of turn at 20 Hz, thruster commands at `pwm_hz`, heartbeats."""
    encoder, data = Encoder(system, component), bytearray()
    every_s = 100.0 + np.arange(round(20 * seconds)) / 20
    turned = zip(every_s.tolist(), turning.rate_rad_s(every_s).tolist(), turning.pwm_us(every_s), strict=True)

    def put(boot_s: float, message: Any) -> bytes:
        return struct.pack(">Q", round((UNIX_S + boot_s + 0.02) * 1e6)) + encoder.encode(message)

    for k, (boot_s, rate, pulse_us) in enumerate(turned):
        us = round(boot_s * 1e6)
        data += put(
            boot_s, mav.MAVLink_highres_imu_message(us, 0, 0, -9.81, 0, 0, rate, 0, 0, 0, 0, 0, 0, 0, 63, 0)
        )
        if k % round(20 / pwm_hz) == 0:
            pwm = [float(pulse_us), 1500.0, 1500.0, 1500.0, *[0.0] * 28]
            data += put(boot_s, mav.MAVLink_actuator_output_status_message(us, 4, pwm))
        if k % 20 == 0:
            data += put(boot_s, mav.MAVLink_heartbeat_message(12, autopilot, 128, 0, 4, 3))
    path.write_bytes(data)
    return path


def logged(
    path: Path,
    turning: Turning,
    clock: Callable[[float], float],
    start_s: float = 110.0,
    seconds: float = 280.0,
    noise_rad_s: float = 0.002,
    parameters: dict[str, float] | None = None,
    sinks: bool = False,
) -> Path:
    """A `.BIN` of boot seconds from `start_s` on, dated by a clock of its own: rates of turn and commands at 25 Hz, and
    where it sinks, by 1 cm/s, depth and the pressure of the water.

    The rates come out of the autopilot's filter, whose corner is among its parameters.
    """
    parameters = {"INS_GYRO_FILTER": 20.0} | (parameters or {})
    records: list[tuple[Any, ...]] = [("PARM", 1, name.encode(), value) for name, value in parameters.items()]
    every_s = start_s + np.arange(round(25 * seconds)) / 25
    rates = np.random.default_rng(9).normal(0.0, noise_rad_s, (len(every_s), 3))
    rates[:, 2] += turning.rate_rad_s(every_s - LATE_S)
    for boot_s, rate, pulse_us in zip(every_s.tolist(), rates, turning.pwm_us(every_s), strict=True):
        us = round(clock(boot_s) * 1e6)
        records.append(("IMU", us, 0, *rate, 0.0, 0.0, -9.81))
        records.append(("RCOU", us, pulse_us, 1500, 1500, 1500))
        if sinks:
            records.append(("CTUN", us, -0.01 * boot_s))
            records.append(("BARO", us, 0, 101_325.0 + 9810.0 * (0.01 * boot_s)))
    path.write_bytes(dataflash(FORMATS, records))
    return path
