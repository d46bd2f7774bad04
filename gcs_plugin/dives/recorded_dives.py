"""The dives of a recording that runs, one after the other, each in a folder of its own."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

from bridge.clock import Clock, EvenClock
from bridge.errors import LogError
from bridge.wire.silences import way_to_mend
from bridge.wire.tlog import STAMP_BYTES, TlogWriter
from gcs_plugin.dives.folder import About, DiveFolder, new_folder
from gcs_plugin.recording.recorder import DiveCounts, Recorder

FULL_BYTES: Final = 2_000_000_000
"""At this size of its files a dive ends and the next begins: a reader refuses a file of more than MOST_BYTES."""
RETRY_S: Final = 60.0
"""Time until the next dive is tried again where none could be begun: the full one grows by a few MB meanwhile."""
FULL: Final = (
    f"the dive has {FULL_BYTES / 1e9:.0f} GB, and little more is read of one: it goes on in the next dive"
)


@dataclass(frozen=True)
class RecordedDive:
    """A dive that is over; `folder` is None if nothing was heard in it, and no folder is kept."""

    folder: Path | None
    count: DiveCounts

    @property
    def words(self) -> str:
        """`1200 frames, 96000 bytes, 0 lost here, 12 lost on the way: dives/2026-11-20T0912Z-hovering`."""
        count = self.count
        counts = f"{count.frames} frames, {count.bytes} bytes, {count.lost} lost here"
        counts += f", {count.missed} lost on the way" if count.missed else ""
        counts += f", {count.unheard_s:.0f} s unheard at a stretch" if count.unheard_s else ""
        return f"{counts}: {self.folder}" if self.folder else counts

    @property
    def advice(self) -> str:
        """How to get the frames of a silence; "" without a silence."""
        if self.folder is None or not self.count.unheard_s:
            return ""
        return f"{self.count.unheard_s:.0f} s unheard: {way_to_mend(self.count.keeps_ring)}"


class RecordedDives:
    """Makes a folder under `root` for each dive, the first at once; `describe` gives the content of its `dive.yaml`.

    `clock` is read on even steps, so that a wall clock that is set changes no name. Raises LogError if no folder can be
    made.
    """

    def __init__(self, root: Path, name: str, describe: Callable[[DiveFolder], About], clock: Clock) -> None:
        self._root, self._name, self._describe, self._clock = root, name, describe, EvenClock(clock)
        self.finished: list[RecordedDive] = []
        self.folder = self._new()
        self._filled: DiveFolder | None = None
        self._retry_s = 0.0

    def unix_s(self) -> float:
        """Current time on the clock of the recording's stamps, which follows no change of the computer's clock."""
        return self._clock.unix_s()

    def free_bytes(self) -> int:
        return self.folder.free_bytes()

    def open_file(self) -> Callable[[int], TlogWriter]:
        """Factory for the files of the present dive."""
        return _opener(self.folder)

    def go_on(self, recorder: Recorder, begun: Callable[[RecordedDive], None]) -> None:
        """Let the recorder begin the next dive between two frames; `begun` then gets the dive before.

        Raises LogError if no folder can be made; the present dive goes on.
        """
        following = self._new(len(self.finished) + 2)

        def change(count: DiveCounts) -> None:
            before = self.end(count)
            self.folder = following
            with suppress(OSError):  # as it prints
                begun(before)

        try:
            recorder.go_on(_opener(following), change)
        except LogError:
            following.discard()
            raise

    def go_on_if_full(self, recorder: Recorder, begun: Callable[[RecordedDive], None]) -> bool:
        """Begin the next dive, as `go_on` does, if the present one holds FULL_BYTES, once for each dive.

        Return whether it was begun. Raises LogError like `go_on`, and is then tried again RETRY_S later.
        """
        # The folder first: the recorder may change to the next dive meanwhile, and its files are then not full.
        full, now_s = self.folder, self._clock.boot_s()
        kept = recorder.kept
        if (
            self._filled is full
            or now_s < self._retry_s
            or kept.bytes + STAMP_BYTES * kept.frames < FULL_BYTES
        ):
            return False
        try:
            self.go_on(recorder, begun)
        except LogError:
            self._retry_s = now_s + RETRY_S
            raise
        self._filled = full
        return True

    def end(self, count: DiveCounts) -> RecordedDive:
        """End the present dive; if nothing was heard in it, discard its folder."""
        if not count.heard:
            self.folder.discard()
        dive = RecordedDive(self.folder.path if count.heard else None, count)
        self.finished.append(dive)
        return dive

    def _new(self, number: int = 1) -> DiveFolder:
        """Make the folder of the dive of that number; from the second on the number is the end of its name."""
        name = f"{self._name}-{number}" if self._name and number > 1 else self._name
        folder = new_folder(self._root, self._clock.unix_s(), name)
        try:
            folder.describe(self._describe(folder))
        except LogError:
            folder.discard()
            raise
        return folder


def _opener(folder: DiveFolder) -> Callable[[int], TlogWriter]:
    """Factory for the files of a folder; a folder that someone removed is described again as it was at first."""
    return partial(folder.open_telemetry, about=folder.about())
