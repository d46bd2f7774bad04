"""Recordings built message by message, so that every value that must come out is known."""

import struct
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mav

from bridge.vehicle.config import VehicleFile
from bridge.wire.framing import Encoder
from identify.dive import Dive
from identify.ingest.open import read_dive

BOOT_UNIX_S = 1_790_000_000.0
NAN = float("nan")

Stamped = tuple[float, int, int, Any]


def heartbeat(kind: int = mav.MAV_TYPE_SUBMARINE, autopilot: int = 0, armed: bool = True) -> Any:
    return mav.MAVLink_heartbeat_message(kind, autopilot, 128 if armed else 0, 0, 4, 3)


def odometry(boot_s: float, velocity: tuple[float, float, float], quality: int = 90) -> Any:
    cov = [NAN] * 21
    us, place, turn = int(boot_s * 1e6), [NAN] * 3, [NAN] * 3
    return mav.MAVLink_odometry_message(
        us, 20, 12, *place, [1.0, 0, 0, 0], *velocity, *turn, cov, cov, 0, 0, quality
    )


def imu(boot_s: float, identifier: int, updated: int, gyro: tuple[float, float, float]) -> Any:
    us = int(boot_s * 1e6)
    return mav.MAVLink_highres_imu_message(us, 0, 0, -9.81, *gyro, 0, 0, 0, 0, 0, 0, 0, updated, identifier)


def array(boot_s: float, name: str, values: Iterable[float], version: int = 1) -> Any:
    padded = [*values, *[0.0] * 58][:58]
    return mav.MAVLink_debug_float_array_message(int(boot_s * 1e6), name.encode(), 256 * version, padded)


def outputs(boot_s: float, pwm: list[float]) -> Any:
    return mav.MAVLink_actuator_output_status_message(int(boot_s * 1e6), 255, [*pwm, *[0.0] * 32][:32])


def servos(boot_us: int, pwm: list[int], port: int = 0) -> Any:
    return mav.MAVLink_servo_output_raw_message(boot_us % 2**32, port, *[*pwm, *[0] * 16][:16])


def attitude(boot_s: float, yaw: float) -> Any:
    return mav.MAVLink_attitude_message(int(boot_s * 1e3), 0, 0, yaw, 0, 0, 0.1)


def recording(messages: Iterable[Stamped], boot_unix_s: float = BOOT_UNIX_S) -> bytes:
    """The bytes of a `.tlog` of (arrival in boot seconds, system, component, message)."""
    encoders: dict[tuple[int, int], Encoder] = {}
    records = b""
    for arrival_s, system, component, message in messages:
        encoder = encoders.setdefault((system, component), Encoder(system, component))
        records += struct.pack(">Q", round((boot_unix_s + arrival_s) * 1e6)) + encoder.encode(message)
    return records


def contract_dive(seconds: int = 10) -> list[Stamped]:
    """Ten messages a second of a vehicle that keeps the contract; surge is a tenth of the time."""
    stamped: list[Stamped] = []
    for k in range(10 * seconds):
        t = 5.0 + k / 10
        messages = [
            odometry(t, (t / 10, 0.2, -0.1)) if k != 3 else odometry(t, (NAN, NAN, NAN), -1),
            imu(t, 0, 0b111111, (0.1, 0.2, 0.3)),
            imu(t, 1, 32, (0.0, 0.0, 0.35)),
            outputs(t, [1500.0, 1600.0]),
            array(t, "TAU_CMD", (1, 2, 3, 4, 5, 6)),
            array(t, "NU_REF", range(14)),
            array(t, "RPM", (0.0, -700.0)),
            mav.MAVLink_attitude_quaternion_message(int(t * 1e3), 1, 0, 0, 0, 0, 0, 0),
            mav.MAVLink_scaled_pressure2_message(int(t * 1e3), 1100.5, 0, 2000),
        ]
        stamped += [(t + 0.02, 1, 1, message) for message in messages]
        if k % 10 == 0:
            slow = [
                heartbeat(),
                mav.MAVLink_system_time_message(int((BOOT_UNIX_S + t) * 1e6), int(t * 1e3)),
                mav.MAVLink_named_value_float_message(int(t * 1e3), b"VEH_CFG", 1.0),
                mav.MAVLink_battery_status_message(0, 0, 0, 0, [16300, *[65535] * 9], 10, 0, 0, 50),
            ]
            stamped += [(t + 0.02, 1, 1, message) for message in slow]
            stamped.append((t + 0.02, 255, 190, heartbeat(mav.MAV_TYPE_GCS, 8, False)))
    return stamped


def write(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


def of_table(folder: Path, rows: str | bytes, columns: str, vehicle: VehicleFile | None = None) -> Dive:
    """The dive of a table and of a column map, both as they stand in their files."""
    written = write(folder / "dive.csv", rows if isinstance(rows, bytes) else rows.encode())
    (folder / "columns.yaml").write_text(columns)
    return read_dive(written, folder / "columns.yaml", vehicle)


def npz(tmp_path: Path, **arrays: Any) -> Path:
    np.savez(tmp_path / "made.npz", **arrays)
    return tmp_path / "made.npz"
