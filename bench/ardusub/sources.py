"""The code that the figures of the real firmware's dives depend on (`bench.stamp`)."""

from typing import Final

SOURCES: Final = (
    "bench/ardusub", "bench/ardusub/*.yaml", "bench/operation/flying.py", "bridge", "bridge/ardusub/applet.lua",
    "gcs_plugin/flying", "identify", "tui/flight_recording.py", "configs/vehicles/bluerov2.yaml",
    "configs/thrusters/*.csv",
)  # fmt: skip
