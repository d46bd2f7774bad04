"""The successive dive folders of a recording."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from bridge.clock import Clock, EvenClock
from bridge.errors import LogError
from bridge.silences import way_to_mend
from bridge.tlog import TlogWriter
from gcs_plugin.asked_conditions import last_conditions
from gcs_plugin.conditions import NOTHING_SAID
from gcs_plugin.folder import About, DiveFolder, new_folder
from gcs_plugin.recorded import Count
from gcs_plugin.recorder import Recorder
from tui import show


@dataclass(frozen=True)
class RecordedDive:
    """A dive that is over; `folder` is None if nothing was heard in it, and no folder is kept."""

    folder: Path | None
    count: Count

    @property
    def words(self) -> str:
        """`1200 frames, 96000 bytes, 0 lost here, 12 lost on the way: dives/2026-11-20T0912Z-hovering`."""
        count = self.count
        counts = f"{count.frames} frames, {count.bytes} bytes, {count.lost} lost here"
        counts += f", {count.missed} lost on the way" if count.missed else ""
        counts += f", {count.unheard_s:.0f} s unheard at a stretch" if count.unheard_s else ""
        counts += f", {count.moved} moved elsewhere" if count.moved else ""
        return f"{counts}: {self.folder}" if self.folder else counts

    @property
    def advice(self) -> str:
        """How to get the frames of a silence; "" without a silence."""
        if self.folder is None or not self.count.unheard_s:
            return ""
        return f"{self.count.unheard_s:.0f} s unheard: {way_to_mend(self.count.keeps_ring)}"


class RecordedDives:
    """Makes a folder under `root` for each dive, the first at once. `about` describes all of them."""

    def __init__(self, root: Path, name: str, about: About, clock: Clock, *, same_conditions: bool) -> None:
        self._root, self._name, self._about, self._clock = root, name, about, EvenClock(clock)
        self._same_conditions = same_conditions
        self.finished: list[RecordedDive] = []
        self.folder = self._new()

    def free_bytes(self) -> int:
        """Free space on the disk."""
        return self.folder.free_bytes()

    def open_file(self) -> Callable[[int], TlogWriter]:
        """Factory for the files of the present dive."""
        return _opener(self.folder)

    def go_on(self, recorder: Recorder, begun: Callable[[Path], None]) -> None:
        """Let the recorder begin the next dive; `begun` gets its folder. Raises LogError if no folder can be made."""
        following = self._new()
        try:
            recorder.go_on(_opener(following), partial(self._change, following, begun))
        except LogError:
            following.discard()
            raise

    def end(self, count: Count) -> RecordedDive:
        """End the present dive; if nothing was heard in it, discard its folder."""
        if not count.heard:
            self.folder.discard()
        dive = RecordedDive(self.folder.path if count.heard else None, count)
        self.finished.append(dive)
        return dive

    def _change(self, following: DiveFolder, begun: Callable[[Path], None], count: Count) -> None:
        dive = self.end(count)
        self.folder = following
        begun(following.path)
        for sentence in filter(None, (dive.words, dive.advice)):
            show.say(show.words(), sentence)
        show.say(show.words(), f"the next dive goes into {following.path}")

    def _new(self) -> DiveFolder:
        folder = new_folder(self._root, self._clock.unix_s(), self._name)
        before = last_conditions(self._root, folder.path)
        try:
            folder.describe(replace(self._about, conditions=before) if self._same_conditions else self._about)
        except LogError:
            folder.discard()
            raise
        if before != NOTHING_SAID:
            note = "taken" if self._same_conditions else "`seatrial conditions --same` takes that"
            show.say(show.words(), f"conditions of the dive before: {before.words}; {note}")
        return folder


def _opener(folder: DiveFolder) -> Callable[[int], TlogWriter]:
    """Factory for the files of a folder; a folder that someone removed is described again as it was at first."""
    return partial(folder.open_telemetry, about=folder.about())
