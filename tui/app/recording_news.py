"""Notices on the recording on screen, as it begins, goes on or ends, and whether its dive is over."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from gcs_plugin.recording.state import Holding
from gcs_plugin.watch.picture import Armed, Picture
from tui.app.desk import Desk
from tui.app.drawing import stopwatch
from tui.app.view import STALE_S, View, heard_of, silent_after


@dataclass(frozen=True)
class Notice:
    """Words for the crew. is_lost: an error, until something is recorded again."""

    words: str
    is_lost: bool = False


class RecordingNews:
    """Compares the recording with the one before. `begins` and `next_dive` end a sentence with the key to press.

    known: folders of the recordings that ran when the app was opened. ordered: the dive that the app itself ended
    last. is_over: the last recording ended, and held frames; whoever is heard after that is shown all the same.
    """

    def __init__(self, desk: Desk, begins: Callable[[], str], next_dive: Callable[[], str]) -> None:
        self.known: set[Path] = set()
        self.ordered: Path | None = None
        self.is_over = False
        self._desk, self._begins, self._next_dive = desk, begins, next_dive
        self._before: Holding | None = None
        self._followed: tuple[str, ...] | None = None
        self._was_armed = self._rests = False
        self._ended_s = math.inf  # when the last recording was seen to have ended, on the clock of pictures
        self._last_heard: Picture | None = None
        self._unwritten_of: float | None = None

    def take(self, view: View, *, ours: bool, flies: bool) -> Iterator[Notice]:
        """News since the last call. ours: the app begins a recording, or has just begun one; flies: a flight runs."""
        now, before = view.recording, self._before
        self._before = now
        if now is not None:
            self.is_over = False
            if before is None and not ours:
                yield from self._of_others(now)
            self._followed = now.links
        if before is not None and (now is None or now.folder != before.folder):
            yield from self._after(before, view, flies)
        if now is not None:
            yield from self._of_writing(now)

    def _after(self, before: Holding, view: View, flies: bool) -> Iterator[Notice]:
        """A recording has ended, or gone on in another dive, unless the app's own order did that."""
        now, folder = view.recording, Path(before.folder)
        self._desk.read_dives()
        # A vehicle that fell silent in order is not lost because its next dive is recorded already.
        self._rests = (self._was_armed or self._rests) and silent_after(view)
        self._was_armed = False
        if now is None and self._desk.was_killed(before.pid):
            words = f"the recording of {folder.name} has ended without being told to{self._begins()}"
            yield Notice(words, is_lost=True)
            return
        # A recording in which nothing arrived was no dive.
        self.is_over = now is None and before.frames > 0
        self._ended_s = view.picture.now_s
        ordered = self.ordered is not None and self.ordered.resolve() == folder.resolve()
        # A flight has a dive of its own, and says itself when it is over.
        if ordered or (now is not None and flies):
            return
        if now is None and not before.frames:
            links = ", ".join(before.links)
            yield Notice(f"the recording of {links} is over; nothing arrived in it{self._begins()}")
            return
        then = self._next_dive() if now is None else "; the next dive is recorded"
        yield Notice(f"the dive {folder.name} is over after {stopwatch(before.lasted_s(view.unix_s))}{then}")

    def _of_others(self, recording: Holding) -> Iterator[Notice]:
        """The app follows a recording of other links than the last one, which did not run when it was opened."""
        if Path(recording.folder) not in self.known and recording.links != self._followed:
            of = f" of {', '.join(recording.links)}" if recording.links else ""
            yield Notice(f"the app follows the recording{of} into {recording.folder}")

    def _of_writing(self, recording: Holding) -> Iterator[Notice]:
        """Frames are written again, after the top line had reported that they were not."""
        if self._unwritten_of == recording.began_unix_s and not recording.unwritten:
            lost = (
                f"{recording.lost} frames are lost"
                if recording.lost
                else "every frame that waited is written"
            )
            yield Notice(f"the recording goes on: {lost}")
        self._unwritten_of = recording.began_unix_s if recording.unwritten else None

    def seen(self, view: View) -> tuple[View, View]:
        """The view with whether its dive is over; and that from which the next step follows, for which a dive is over
        only once its vehicle, armed before, fell silent.
        """
        self._was_armed = self._was_armed or view.picture.armed is Armed.ARMED
        if view.behind_s <= STALE_S and heard_of(view.picture) is not None:
            self._last_heard = view.picture
        silent = silent_after(view)
        ended, rests = self._was_armed and silent, self._rests and silent
        waits = rests and not ended and view.recording is not None
        over = (self.is_over and not self._beats_on(view.picture)) or ended or rests
        shown = replace(view, over=over, waits=waits, last_heard=self._last_heard)
        return shown, replace(view, over=ended, last_heard=self._last_heard)

    def _beats_on(self, picture: Picture) -> bool:
        """Whether the vehicle beats by a link of the app's own since the recording ended: it may be armed still, and
        its alarms hold. What came by way of the recording came earlier."""
        return picture.now_s - picture.armed_age_s > self._ended_s + STALE_S
