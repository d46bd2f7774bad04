"""What the screens work on together: the vehicle, the folders, the dive that was chosen, the verbs at work."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from bridge.errors import ConfigError, LogError
from gcs_plugin.folder import DiveFolder, list_folders
from tui.app.jobs import Jobs
from tui.app.replay import Replay
from tui.dive_vehicle import vehicle_named

DIVES: Final = Path("dives")
RECEIPTS: Final = Path("receipts")


def nothing_recorded() -> Path | None:
    """The dive that is being recorded, where none is."""
    return None


@dataclass
class Desk:
    """`vehicle` is FILE[:CONFIGURATION], or ""; `out` holds the dive folders, `receipts` what uploads leave.

    `dive` is the one that was chosen on the screen Dives, or that a verb was begun on, None for the newest; `param` the
    parameter file that the screen Parameters is to show, None for the one beside that dive; `replay` what Watch shows
    in place of the vehicle, None for the vehicle. `record` begins a recording where none runs, None where nothing is to
    be recorded; `recorded` tells the dive that is being recorded. `next_dive` lets the recording that runs go on in a
    new folder, `end_recording` ends it: both wait for it, answer the folder of the dive that is over, and raise
    SeatrialError; None where the app has no say.
    """

    vehicle: str = ""
    out: Path = DIVES
    receipts: Path = RECEIPTS
    dive: Path | None = None
    param: Path | None = None
    jobs: Jobs = field(default_factory=Jobs)
    replay: Replay | None = None
    record: Callable[[], None] | None = None
    recorded: Callable[[], Path | None] = nothing_recorded
    next_dive: Callable[[], Path] | None = None
    end_recording: Callable[[], Path] | None = None
    _meant: tuple[Path, Path | None] | None = field(default=None, init=False)

    def chosen(self) -> Path | None:
        """The dive that was chosen, else the one that is meant, else the newest that is finished, else the one that is
        being recorded."""
        if self.dive is not None:
            return self.dive
        newest = self._newest()
        if self._meant is not None and self._meant[1] == newest:
            return self._meant[0]
        return newest

    def mean(self, dive: Path | None) -> None:
        """The dive that the crew most likely comes from, of all that are there now; no longer once another is there."""
        self._meant = None if dive is None else (dive, self._newest())

    def _newest(self) -> Path | None:
        dives, recorded = self.dives(), self.recorded()
        finished = [path for path in dives if recorded is None or path.resolve() != recorded.resolve()]
        return next(reversed(finished or dives), None)

    def dives(self) -> list[Path]:
        """All dives, the oldest first, as the verb `dives` lists them; none where their folder can't be read."""
        try:
            return [folder.path for folder in list_folders(self.out)]
        except LogError:
            return []

    def vehicle_of(self, dive: Path) -> str:
        """The vehicle file that a dive's `dive.yaml` names, with its configuration; else the app's; "" for none."""
        try:
            return vehicle_named(DiveFolder(dive).about(), self.vehicle)
        except ConfigError:
            return self.vehicle
