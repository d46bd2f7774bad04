"""Dives to compare with a dive (same vehicle and configuration), and dives that can check its diagnosis."""

import math
from pathlib import Path
from typing import Final

from gcs_plugin.dive_length import length_s
from tui.app.desk import Desk
from tui.dive_list import kept_glance

LEAST_S: Final = 20.0
"""A shorter dive is rejected as a check dive, and so is a dive in which no thruster pushed."""


def check_dives(desk: Desk, dive: Path) -> tuple[Path, ...]:
    """Other dives with the same vehicle and configuration, the newest first, without the dive being recorded."""
    recorded = desk.recorded()
    excluded = {dive.resolve()} | ({recorded.resolve()} if recorded is not None else set())
    vehicle = desk.vehicle_of(dive)
    return tuple(
        folder
        for folder in reversed(desk.dives())
        if folder.resolve() not in excluded and desk.vehicle_of(folder) == vehicle
    )


def can_check(folder: Path) -> bool:
    """Whether a dive may check a diagnosis, judged by the facts known without reading it."""
    glance = kept_glance(folder)
    if glance is None:
        lasts_s = length_s(folder)
        return lasts_s is None or lasts_s >= LEAST_S
    relative_std = glance.relative_std
    nothing = relative_std is not None and not any(map(math.isfinite, relative_std.values()))
    return not (glance.error or glance.duration_s < LEAST_S or nothing)
