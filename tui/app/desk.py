"""State that the screens share: vehicle, folders, the chosen dive, those to compare it with, and the running verbs."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Final

from bridge.errors import ConfigError, LogError
from bridge.files import written_ns
from bridge.vehicle.config import load_vehicle
from gcs_plugin.dives.folder import ABOUT, About, DiveFolder, list_folders, vehicle_named
from gcs_plugin.dives.recordings import length_s, recordings
from gcs_plugin.locks import is_being_written
from gcs_plugin.params.last_accepted import kept_of
from gcs_plugin.params.receipt import RECEIPT, path_of
from tui.app.connecting import Choice, Way, ways_now
from tui.app.diagnosis import is_contradicted
from tui.app.jobs import Jobs, newer
from tui.app.view import Replay
from tui.dive_list import kept_glance

DIVES: Final = Path("dives")
RECEIPTS: Final = Path("receipts")
LIST: Final = "dives"
"""The job that reads the dives, so that the next step is known on every screen."""

IDENTIFIED, DIAGNOSED, ACCEPTABLE, VALIDATED = (
    "identified.param", "diagnosis.json", "diagnosed.param", "validation.json",
)  # fmt: skip
"""Files that the screens leave next to a dive: its values; its diagnosis, and the model with the causes found."""

FEW: Final = 4
"""Of the newest dives: those that may still be written."""
LEAST_S: Final = 20.0
"""A shorter dive is rejected as a check dive, and so is a dive in which no thruster pushed."""


@dataclass
class Desk:
    """Shared state of the screens.

    `vehicle` is FILE[:CONFIGURATION], or ""; `out` holds the dive folders, `receipts` the files of uploads.

    `dive` is the dive chosen on the screen Dives or by starting a verb on it, None for the newest; `param` the
    parameter file for the screen Parameters, None for the file next to that dive; `replay` the replay that Watch
    shows in place of the vehicle, None for the vehicle. `record` begins a recording if none runs, None if nothing is
    to be recorded; `recorded` returns the dive being recorded. `next_dive` lets the running recording go on in a new
    folder, `end_recording` ends it: both wait for it, return the folder of the finished dive, and raise
    SeatrialError; None if the app may not give such orders. `links` are those that `record` would record, () while
    none is known; `ways` lists the ways to a vehicle, and `connect` goes one of them, raises SeatrialError, and is
    None if the app may not; `link` is one that is only looked at, "" where the vehicle shown is that of the running
    recording. `name_vehicle` takes FILE[:CONFIGURATION] for dives that name none, raises ConfigError if
    there is no such file, and is None if the app may not. `was_killed` says whether the recording of a process ended
    without having been told to.
    """

    vehicle: str = ""
    out: Path = DIVES
    receipts: Path = RECEIPTS
    dive: Path | None = None
    param: Path | None = None
    jobs: Jobs = field(default_factory=Jobs)
    replay: Replay | None = None
    record: Callable[[], None] | None = None
    recorded: Callable[[], Path | None] = lambda: None
    next_dive: Callable[[], Path] | None = None
    end_recording: Callable[[], Path] | None = None
    links: Callable[[], tuple[str, ...]] = tuple
    ways: Callable[[], tuple[Way, ...]] = ways_now
    link: Callable[[], str] = str
    connect: Callable[[Choice], None] | None = None
    name_vehicle: Callable[[str], None] | None = None
    was_killed: Callable[[int], bool] = lambda _: False
    then: str = field(default="", init=False)
    _meant: tuple[Path, Path | None] | None = field(default=None, init=False)

    def chosen(self) -> Path | None:
        """The chosen dive, else the likely dive (see `mean`), else the newest finished, else the one being recorded."""
        if self.dive is not None:
            return self.dive
        newest = self._newest()
        if self._meant is not None and self._meant[1] == newest:
            return self._meant[0]
        return newest

    @property
    def no_dive(self) -> str:
        """Sentence for a screen that has no dive to show."""
        return f"no dive in {self.out} yet; a recording makes one"

    @property
    def way(self) -> tuple[str, ...]:
        """Option by which a verb reaches the vehicle shown: without it, a verb goes to that of the running recording,
        which may be another one's."""
        link = self.link()
        return ("--link", link) if link else ()

    def read_dives(self) -> bool:
        """Begin to read the dives; False if they are being read already."""
        if self.jobs.runs(LIST):
            return False
        vehicle = ("--otherwise", self.vehicle) if self.vehicle else ()
        self.jobs.start(LIST, (LIST, str(self.out), *vehicle))
        return True

    def mean(self, dive: Path | None) -> None:
        """Set the dive that the crew most likely means; it holds until a newer dive appears."""
        self._meant = None if dive is None else (dive, self._newest())

    def _newest(self) -> Path | None:
        dives = self.dives()
        return next(filter(self.is_finished, reversed(dives)), next(reversed(dives), None))

    def is_finished(self, dive: Path) -> bool:
        """Whether no program writes the dive's recording any more."""
        recorded = self.recorded()
        if recorded is not None and dive.resolve() == recorded.resolve():
            return False
        return not any(map(is_being_written, recordings(dive)))

    def written(self) -> frozenset[Path]:
        """The dives that are being written, resolved: by this app's recording, and of the newest few by any program."""
        recorded = self.recorded()
        ours = frozenset() if recorded is None else frozenset({recorded.resolve()})
        return ours | {dive.resolve() for dive in self.dives()[-FEW:] if not self.is_finished(dive)}

    def dives(self) -> list[Path]:
        """All dives, the oldest first, in the order of the verb `dives`; empty if their folder can't be read."""
        try:
            return [folder.path for folder in list_folders(self.out)]
        except LogError:
            return []

    def values(self, dive: Path | None) -> Path | None:
        """The newest file of values of all dives of that dive's vehicle, in any configuration; of any vehicle for None.

        Those of another vehicle are not to be sent to it.
        """
        if dive is None:
            return values_of(*self.dives())
        vehicle = self._vehicle(dive)
        return values_of(*(each for each in self.dives() if self._vehicle(each) == vehicle))

    def _vehicle(self, dive: Path) -> str:
        """Name of the dive's vehicle file, wherever that lies."""
        vehicle = self.vehicle_of(dive)
        return Path(vehicle.rpartition(":")[0] or vehicle).stem

    def vehicle_of(self, dive: Path) -> str:
        """The vehicle file and configuration that the dive's `dive.yaml` names; else the app's; "" for none."""
        try:
            return vehicle_named(_about(dive, written_ns(dive / ABOUT)), self.vehicle)
        except ConfigError:
            return self.vehicle


@lru_cache(4096)
def _about(dive: Path, _changed_ns: int) -> About:
    """What is noted of a dive, read once for each change: to compare one with hundreds of others asks it of each."""
    return DiveFolder(dive).about()


def values_of(*dives: Path) -> Path | None:
    """The newest file of values of these dives, by its own time; None if they have none.

    Leaves out the model of an earlier diagnosis if a later one found nothing, and of one whose check contradicts it.
    """
    files = (dive / name for dive in dives for name in (IDENTIFIED, ACCEPTABLE))
    newest_first = sorted(filter(written_ns, files), key=written_ns, reverse=True)
    # The newest is looked at first: to read every diagnosis of hundreds of dives takes seconds.
    return next((f for f in newest_first if f.name == IDENTIFIED or is_acceptable(f.parent)), None)


def is_acceptable(dive: Path) -> bool:
    """Whether the model that a diagnosis left beside a dive is its newest answer, and no check dive contradicts it."""
    return newer(dive / ACCEPTABLE, dive / DIAGNOSED) and not is_contradicted(dive / DIAGNOSED)


def check_dives(desk: Desk, dive: Path) -> tuple[Path, ...]:
    """Other finished dives with the same vehicle and configuration, the newest first."""
    vehicle = desk.vehicle_of(dive)
    return tuple(
        folder
        for folder in reversed(desk.dives())
        if folder.resolve() != dive.resolve()
        and desk.is_finished(folder)
        and desk.vehicle_of(folder) == vehicle
    )


def nearest_first(desk: Desk, dive: Path, others: Sequence[Path]) -> tuple[Path, ...]:
    """Dives to check a diagnosis of a dive on, the best first: flown with the values that it was flown with, then later
    than it, then near to it in time. Uploads to other vehicles change nothing."""
    kept = kept_of(desk.receipts, _name_of(desk.vehicle_of(dive)))
    changed_ns = [written_ns(path_of(upload.preimage, RECEIPT)) for upload in kept]

    def changes(ended_ns: int) -> int:
        return sum(change_ns < ended_ns for change_ns in changed_ns)

    of_dive_ns = ended_ns(dive)

    def rank(other: Path) -> tuple[bool, bool, int]:
        other_ns = ended_ns(other)
        return (changes(other_ns) != changes(of_dive_ns), other_ns < of_dive_ns, abs(other_ns - of_dive_ns))

    return tuple(sorted(others, key=rank))


def _name_of(vehicle: str) -> str:
    """The name in a vehicle file; "" without one that can be read."""
    try:
        return load_vehicle(vehicle).vehicle.name if vehicle else ""
    except ConfigError:
        return ""


def ended_ns(dive: Path) -> int:
    """When a dive's recording was last written, ns; 0 if it has none."""
    return max(map(written_ns, recordings(dive)), default=0)


def can_check(folder: Path) -> bool:
    """Whether a dive may check a diagnosis, judged by the facts known without reading it."""
    glance = kept_glance(folder)
    if glance is None:
        lasts_s = length_s(folder)
        return lasts_s is None or lasts_s >= LEAST_S
    relative_std = glance.relative_std
    nothing = relative_std is not None and not any(map(math.isfinite, relative_std.values()))
    return not (glance.error or glance.duration_s < LEAST_S or nothing)
