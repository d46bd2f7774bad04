"""Which dives can stand beside one, others of the same vehicle in the same configuration; and which can check it."""

import math
from pathlib import Path
from typing import Final

from gcs_plugin.dive_length import length_s
from tui.app.desk import Desk
from tui.dive_list import kept_glance

LEAST_S: Final = 20.0
"""A shorter dive is refused as a check, as is one in which no thruster pushed."""


def check_dives(desk: Desk, dive: Path) -> tuple[Path, ...]:
    """The newest first; not the dive itself, nor the one that is being recorded."""
    recorded = desk.recorded()
    out = {dive.resolve()} | ({recorded.resolve()} if recorded is not None else set())
    vehicle = desk.vehicle_of(dive)
    return tuple(
        folder
        for folder in reversed(desk.dives())
        if folder.resolve() not in out and desk.vehicle_of(folder) == vehicle
    )


def can_check(folder: Path) -> bool:
    """Whether nothing that is known of a dive at once says that no diagnosis can be checked on it."""
    glance = kept_glance(folder)
    if glance is None:
        lasts_s = length_s(folder)
        return lasts_s is None or lasts_s >= LEAST_S
    told = glance.relative_std
    nothing = told is not None and not any(map(math.isfinite, told.values()))
    return not (glance.error or glance.duration_s < LEAST_S or nothing)
