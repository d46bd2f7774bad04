# SPDX-License-Identifier: GPL-3.0-or-later
"""`seatrial record`: recording by MAVProxy itself, or by another process whose hub MAVProxy listens to.

The recording holds all traffic on MAVProxy's links, in both directions, in a dive folder.
"""

import threading
from collections.abc import Callable, Iterator
from math import isfinite
from pathlib import Path
from queue import SimpleQueue
from typing import Final

from bridge.clock import Clock
from bridge.errors import LogError, SeatrialError
from bridge.links.addresses import among, same_link
from bridge.links.link import Link, memory_pair
from bridge.vehicle.config import VehicleFile
from bridge.wire.framing import Frame
from gcs_plugin.dives.folder import About, DiveFolder, about_vehicle, list_folders
from gcs_plugin.dives.recorded_dives import FULL, RecordedDive, RecordedDives
from gcs_plugin.locks import is_being_written
from gcs_plugin.recording import orders
from gcs_plugin.recording.recorder import Notice, Recorder
from gcs_plugin.recording.state import Holding, held

TELL_RATE_AFTER_S: Final = 5.0


class Recording:
    """Records from its creation until `close`, one dive or several; `say` gets problems and the end of each dive.

    A separate thread syncs the disk.
    """

    def __init__(
        self, root: Path, file: VehicleFile | None, clock: Clock, say: Callable[[str], None]
    ) -> None:
        self._clock, self._say = clock, say
        self._passed: dict[str, bytearray] = {}
        self._frames: dict[str, Link] = {}
        name = (file.configuration or "") if file else ""
        about = about_vehicle(file, name) if file else About()
        self.dives, self._began_s = RecordedDives(root, name, lambda _: about, clock), clock.boot_s()

        def notice(said: Notice) -> None:
            say(f"{said.level}: {said.sentence}")

        self._recorder = Recorder(
            [], self.dives.open_file(), clock, self.dives.free_bytes, notice, None, None
        )
        self._end_sync = self._recorder.begin_sync()

    @property
    def finished(self) -> Path | None:
        """The folder of the dive that ended last."""
        return next((dive.folder for dive in reversed(self.dives.finished) if dive.folder), None)

    def keep(self, frame: Frame, link: str) -> None:
        """Take a frame that passed on the link of that name, in either direction."""
        self._passed.setdefault(link, bytearray()).extend(frame.raw)

    def step(self) -> None:
        """Write the frames that have come."""
        for name, passed in self._passed.items():
            if name not in self._frames:
                # A link each: over a second one, a vehicle's frames come again and later, which is no second vehicle.
                self._frames[name], recorded = memory_pair()
                recorded.name = name
                self._recorder.add(recorded)
            self._frames[name].write(bytes(passed))
            passed.clear()
        self._recorder.step(0.0)
        try:
            if self.dives.go_on_if_full(self._recorder, self._begun):
                self._say(FULL)
        except LogError as error:
            self._say(f"no next dive: {error}")

    def go_on(self) -> None:
        """Begin the next dive in a new folder, between two frames. Raises LogError if no folder can be made."""
        self.dives.go_on(self._recorder, self._begun)

    def close(self) -> None:
        self._end_sync()
        self._recorder.close()
        self._over(self.dives.end(self._recorder.count))

    def words(self) -> str:
        """Describe the progress: folder, duration, number of frames and disk space left."""
        span_s = max(self._clock.boot_s() - self._began_s, 1e-3)
        rate = self._recorder.kept.bytes / span_s if span_s >= TELL_RATE_AFTER_S else 0.0
        free = self.dives.free_bytes()
        left = f"{free / rate / 3600:.0f} h of disk left" if rate > 0 else f"{free / 1e9:.1f} GB of disk left"
        return (
            f"recording into {self.dives.folder.path}: {progress(span_s, self._recorder.kept.frames, left)}"
        )

    def _begun(self, before: RecordedDive) -> None:
        self._over(before)
        self._began_s = self._clock.boot_s()
        self._say(self.words())

    def _over(self, dive: RecordedDive) -> None:
        """Say how much the finished dive holds."""
        if dive.folder is None:
            self._say("nothing passed in this dive, and no dive folder is kept")
            return
        self._say(f"recorded {dive.words}")
        if dive.advice:
            self._say(dive.advice)


def progress(span_s: float, frames: int, left: str) -> str:
    """Format as `00:12:31, 1234 frames, 41 h of disk left`."""
    clock = f"{int(span_s) // 3600:02d}:{int(span_s) // 60 % 60:02d}:{int(span_s) % 60:02d}"
    return f"{clock}, {frames} frames, {left}"


BEGIN: Final = "`seatrial record start` begins"


class Recordings:
    """Manages at most one recording of MAVProxy's own.

    `links` returns the names of MAVProxy's links, `vehicle` the vehicle file to be named in a dive.
    """

    def __init__(
        self,
        clock: Clock,
        say: Callable[[str], None],
        links: Callable[[], list[str]],
        vehicle: Callable[[], VehicleFile | None],
    ) -> None:
        self._clock, self._say, self._links, self._vehicle = clock, say, links, vehicle
        self._recording: Recording | None = None
        self._order: threading.Thread | None = None
        self._answers: SimpleQueue[str] = SimpleQueue()
        self._root = Path("dives")
        self._finished: Path | None = None

    def command(self, words: list[str]) -> bool:
        """Handle `record WORDS`; False for an unknown command. Raises SeatrialError."""
        match words:
            case ["start", *folder] if len(folder) <= 1:
                root = Path(folder[0] if folder else "dives")
                # The one that runs goes on where another can't begin.
                following = Recording(root, self._vehicle(), self._clock, self._say)
                self.stop()
                self._root, self._recording = root, following
                self._say(following.words())
            case ["next"]:
                self._next()
            case ["stop"]:
                if self._recording is None:
                    other = self._other()
                    ends = (
                        other
                        and f"process {other.pid} records, not MAVProxy; `seatrial record --end` ends it"
                    )
                    raise LogError(ends or f"nothing is being recorded; {BEGIN}")
                self.stop()
            case ["note", *text] if text:
                noted, unix_s = self._noted()
                noted.add_event(unix_s, " ".join(text))
                self._say(f"noted in {noted.path}")
            case _:
                return False
        return True

    def keep(self, frame: Frame, link: str) -> None:
        """Take a frame that passed on the link of that name, in either direction."""
        if self._recording is not None:
            self._recording.keep(frame, link)

    def tick(self) -> None:
        """Write the frames that have come, and say whether another process began its next dive."""
        if self._recording is not None:
            self._recording.step()
        if self._order is not None and not self._answers.empty():
            self._say(self._answers.get())
            self._order = None

    def stop(self) -> None:
        """End MAVProxy's own recording, if any."""
        recording, self._recording = self._recording, None
        if recording is not None:
            recording.step()
            recording.close()
            self._finished = recording.finished or self._finished

    def status(self) -> list[str]:
        """Lines on who records into which folder, and which links nobody records."""
        lines = [self._recording.words()] if self._recording is not None else []
        holding = self._other()
        if holding is not None:
            lines.append(_words(holding, self._clock.unix_s()))
        if self._recording is not None:
            return lines
        bare = [name for name in self._links() if holding is None or not same_link(name, holding.hub)]
        if holding is not None and bare:
            lines.append(f"NOT RECORDING {', '.join(bare)}")
        elif holding is None:
            elsewhere = held(self._clock.unix_s())
            who = f"; process {elsewhere.pid} records {', '.join(elsewhere.links)}" if elsewhere else ""
            lines.append(f"NOT RECORDING{who}")
        return lines

    def newest(self) -> Path:
        """The dive that ended last, never the one being recorded. Raises LogError if none has ended."""
        holding, dive, present = self._other(), self._finished, None
        if self._recording is not None:
            present = self._recording.dives.folder.path
            dive = self._recording.finished or dive or newest_dive(self._root, present)
        elif holding is not None:
            present = Path(holding.folder)
            dive = newest_dive(present.parent, present)
        else:
            dive = dive or newest_dive(self._root)
            if dive is None and (elsewhere := next(_recorded(self._root), None)) is not None:
                raise LogError(
                    f"no dive is over yet, {elsewhere} is being recorded by another program; end it there, or give a "
                    "DIVE"
                )
        if dive is None and present is not None:
            raise LogError(
                f"no dive is over yet, {present} is being recorded; `seatrial record next` ends it, or give a DIVE"
            )
        if dive is None:
            raise LogError(
                f"{self._root}: no dive folder is there; give a DIVE, or `seatrial record start` first"
            )
        return dive

    def _next(self) -> None:
        """Continue in a new dive folder. Another process is asked in a thread, as it may take long."""
        if self._recording is not None:
            self._recording.go_on()
            return
        if self._other() is None:
            raise LogError(f"nothing is being recorded that could go on in a new dive; {BEGIN}")
        if self._order is not None:
            raise LogError("the next dive is being begun already; wait")
        self._order = threading.Thread(target=self._ask_for_next, name="next dive", daemon=True)
        self._order.start()

    def _ask_for_next(self) -> None:
        """Ask the other process, which may take seconds; the next `tick` says its answer."""
        try:
            self._answers.put(orders.became(*orders.next_dive(self._clock)))
        except SeatrialError as error:
            self._answers.put(f"seatrial: {error}")
        except Exception as error:  # noqa: BLE001 (without an answer no next dive could be ordered again)
            self._answers.put(f"seatrial: the next dive could not be ordered ({error}); order it again")

    def _noted(self) -> tuple[DiveFolder, float]:
        """Folder of the dive being recorded, and Unix time by its recording. Raises LogError if nothing is recorded."""
        if self._recording is not None:
            return self._recording.dives.folder, self._recording.dives.unix_s()
        holding = self._other()
        if holding is None:
            raise LogError(f"nothing is being recorded that a note could go to; {BEGIN}")
        return DiveFolder(Path(holding.folder)), holding.own_unix_s(self._clock.unix_s())

    def _other(self) -> Holding | None:
        """The recording of another process whose hub carries the vehicle to MAVProxy, if any."""
        holding = held(self._clock.unix_s())
        return holding if holding is not None and among(holding.hub, self._links()) else None


def newest_dive(root: Path, but: Path | None = None) -> Path | None:
    """The dive folder under `root` that was begun last and holds a recording, except `but` and those that a recorder
    still writes; None if there is none."""
    made = [folder for folder in list_folders(root) if folder.telemetry() and folder.path != but]
    return next((folder.path for folder in reversed(made) if not _is_recorded(folder)), None)


def _recorded(root: Path) -> Iterator[Path]:
    """The dive folders under `root` that a recorder still writes."""
    return (folder.path for folder in list_folders(root) if _is_recorded(folder))


def _is_recorded(folder: DiveFolder) -> bool:
    return any(map(is_being_written, folder.heard()))


def _words(holding: Holding, unix_s: float) -> str:
    """Describe another process's recording and its progress."""
    left = (
        f"{holding.disk_left_s / 3600:.0f} h of disk left"
        if isfinite(holding.disk_left_s)
        else "nothing comes"
    )
    lost = f", {holding.lost} LOST" if holding.lost else ""
    how = progress(holding.lasted_s(unix_s), holding.frames, left)
    unwritten = f", NOT WRITTEN: {holding.unwritten}" if holding.unwritten else ""
    return f"recorded by process {holding.pid} into {holding.folder}: {how}{lost}{unwritten}"
