"""The code that the figures of the real firmware's dives depend on (`bench.stamp`)."""

from typing import Final

SOURCES: Final = (
    "bench/ardusub", "bench/flying.py", "bridge", "gcs_plugin/flying", "identify", "tui/flying.py",
    "configs/vehicles/bluerov2.yaml", "configs/thrusters/*.csv",
)  # fmt: skip
