"""Which dives a diagnosis can be checked on: others of the same vehicle in the same configuration."""

from pathlib import Path

from tui.app.desk import Desk


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
