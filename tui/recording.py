"""A running recording: its successive dive folders, the state that other programs read, the texts of its vehicles."""

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from bridge.clock import Clock, EvenClock
from bridge.errors import LogError
from bridge.links.secured import Opener
from bridge.wire.silences import way_to_mend
from bridge.wire.tlog import TlogWriter
from gcs_plugin.dives.conditions import NOTHING_SAID
from gcs_plugin.dives.folder import About, DiveFolder, last_conditions, new_folder, utc_text
from gcs_plugin.recording.recorder import Count, Notice, Recorded, Recorder
from gcs_plugin.recording.state import HeardVehicle, Holding, held, release, write_holding
from gcs_plugin.watch import hearing
from tui import show
from tui.links import words_of


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


MOST_NOTICES = 5


class RecordingState:
    """State of the recording of `links` into `folder`; in a second file while another recording is the default.

    `hub` is the address at which it serves its links, "" if it serves nobody; `opener` opened them, with the key in
    `sign_key`.
    """

    def __init__(
        self,
        clock: Clock,
        links: tuple[str, ...],
        folder: Path,
        hub: str,
        opener: Opener,
        sign_key: str = "",
    ) -> None:
        self._opener = opener
        self._sign_key = str(Path(sign_key).absolute()) if sign_key else ""
        self._clock, self._links, self._hub = clock, links, hub
        self._own_clock = EvenClock(clock)
        self.begin(folder)
        self._notices: tuple[str, ...] = ()
        self._fault = ""

    @property
    def way(self) -> str:
        """How other programs reach the links of this recording, in a sentence."""
        first = self._other()
        if first is not None:
            own_links = (
                f"; the links of this one are at {self._hub}, or by their names with --link"
                if self._hub
                else ""
            )
            return f"params, doctor, ff and note go by way of {words_of(first)}{own_links}"
        if not self._hub:
            return "its links serve nobody else"
        return f"params, doctor, ff and note go by way of it, at {self._hub}"

    def begin(self, folder: Path) -> None:
        """Begin a dive in this folder."""
        # A single assignment, because another thread may be writing the state.
        self._dive = (folder, utc_text(self._own_clock.unix_s()))

    def notice(self, said: Notice) -> None:
        """Keep a notice that an operator must read."""
        self._notices = (*self._notices, f"{said.level}: {said.sentence}")[-MOST_NOTICES:]

    def tell(self, recorder: Recorder) -> None:
        """Write the state now; if that fails, say so once."""
        folder, began_utc = self._dive
        holding = Holding(
            os.getpid(),
            self._hub,
            self._links,
            str(folder.absolute()),
            began_utc,
            recorder.recorded,
            recorder.recorded_bytes,
            recorder.lost,
            recorder.disk_left_s,
            self._notices,
            self._clock.unix_s(),
            "; ".join(filter(None, map(self._opener.words, self._links))),
            next(filter(None, map(self._opener.trouble, self._links)), ""),
            self._sign_key,
            recorder.unwritten.replace(f"{folder}/", ""),
            recorder.waiting,
            round(self._clock.unix_s() - self._own_clock.unix_s(), 3),
            self._vehicles(recorder),
        )
        try:
            write_holding(holding, second=self._other() is not None)
            self._fault = ""
        except LogError as error:
            if not self._fault:
                show.say(show.words(), f"warning: {error}")
            self._fault = str(error)

    def end(self) -> None:
        """Remove the state."""
        release()

    def _vehicles(self, recorder: Recorder) -> tuple[HeardVehicle, ...]:
        boot_s, unix_s = self._clock.boot_s(), self._clock.unix_s()
        return tuple(
            HeardVehicle(*vehicle.source, vehicle.holds, round(unix_s - boot_s + vehicle.heard_s, 3))
            for vehicle in recorder.vehicles
        )

    def _other(self) -> Holding | None:
        holding = held(self._clock.unix_s())
        return holding if holding is not None and holding.pid != os.getpid() else None


class StatusTexts(hearing.StatusTexts):
    """Takes every frame of a link; `tell` gets each complete text with the number of its vehicle."""

    def __init__(self, tell: Callable[[str], None]) -> None:
        super().__init__(lambda source, _severity, text: tell(f"vehicle {source[0]}: {text.words}"))


class TellingRecorder(Recorder):
    """A recorder that passes on the texts of vehicles."""

    def __init__(self, tell: Callable[[str], None], *of_recorder: Any) -> None:
        self._texts = StatusTexts(tell)
        super().__init__(*of_recorder)

    def step(self, timeout_s: float) -> list[Recorded]:
        taken = super().step(timeout_s)
        for item in taken:
            self._texts.hear(item.frame)
        return taken
