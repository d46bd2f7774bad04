"""A simulated dive as somebody else's program would export it: axes of ROS, angles in degrees, depth as a height."""

from pathlib import Path

import numpy as np

from identify.challenge.case import dive_of, draw_case
from identify.ingest.rotation import euler_angles

FLU = np.array([1.0, -1.0, -1.0])
RUNS = 3


def write_foreign_log(folder: Path, seconds: float, seed: int = 100_011) -> None:
    """Write `our_log.csv`, a row for each time of any sensor, its thirds as runs in `runs`, and `our.yaml`, the vehicle
    file."""
    case = draw_case(seed, names=[], seconds=seconds)
    (folder / "our.yaml").write_text(case.vehicle.text, encoding="utf-8")
    dive = dive_of(case)
    signals = dive.signals()
    depth = signals["pressure"].value / 9800.0 - 10.3
    angles = np.degrees(np.column_stack(euler_angles(signals["attitude"].value)) * FLU)
    columns = [
        (signals["velocity"].time_s, signals["velocity"].value * FLU, ("vel.x", "vel.y", "vel.z")),
        (signals["gyro"].time_s, signals["gyro"].value * FLU, ("gyro.x", "gyro.y", "gyro.z")),
        (
            signals["specific_force"].time_s,
            signals["specific_force"].value * FLU,
            ("acc.x", "acc.y", "acc.z"),
        ),
        (signals["attitude"].time_s, angles, ("roll", "pitch", "yaw")),
        (signals["pressure"].time_s, -depth, ("position.z",)),
        (signals["pwm"].time_s, signals["pwm"].value, tuple(f"thruster_{k + 1}" for k in range(8))),
        (signals["voltage"].time_s, signals["voltage"].value, ("battery_voltage",)),
    ]
    times = np.unique(np.concatenate([time_s for time_s, _, _ in columns]))
    cells = [np.full((len(times), len(names)), np.nan) for _, _, names in columns]
    for table, (time_s, value, _) in zip(cells, columns, strict=True):
        table[np.searchsorted(times, time_s)] = value
    header = ",".join(("timestamp_ms", *(name for _, _, names in columns for name in names)))
    rows = np.column_stack([times * 1e3, *cells])
    lines = [",".join("" if np.isnan(cell) else f"{cell:.9g}" for cell in row) for row in rows]
    (folder / "our_log.csv").write_text("\n".join((header, *lines)) + "\n", encoding="utf-8")
    (folder / "runs").mkdir()
    for number, part in enumerate(np.array_split(np.arange(len(lines)), RUNS), start=1):
        text = "\n".join((header, *(lines[k] for k in part.tolist()))) + "\n"
        (folder / "runs" / f"run{number}.csv").write_text(text, encoding="utf-8")
