# SPDX-License-Identifier: GPL-3.0-or-later
"""Record all traffic on MAVProxy's links, in both directions, into a dive folder."""

import threading
from collections import deque
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Final

from bridge.clock import Clock, EvenClock
from bridge.errors import LinkError, LogError
from bridge.framing import Frame
from bridge.tlog import TlogWriter
from bridge.vehicle.config import VehicleFile
from gcs_plugin.folder import About, DiveFolder, about_vehicle, new_folder
from gcs_plugin.recorded import Count, Notice
from gcs_plugin.recorder import SYNC_EVERY_S, Recorder

TELL_RATE_AFTER_S: Final = 5.0


class _Frames:
    """The link that the recorder reads: the frames of all links in the order in which they passed."""

    name = "MAVProxy"

    def __init__(self) -> None:
        self.waiting: deque[bytes] = deque()

    def read(self, timeout_s: float) -> bytes:
        del timeout_s
        data = b"".join(self.waiting)
        self.waiting.clear()
        return data

    def write(self, data: bytes) -> None:
        raise LinkError(
            f"{self.name}: {len(data)} bytes can't be sent here; nothing is, a recording only listens"
        )

    def close(self) -> None:
        self.waiting.clear()


class Recording:
    """Records from its creation until `close`, one dive or several; `say` gets problems and the end of each dive.

    A separate thread syncs the disk. `finished` is the dive that ended last, `folder` the folder of the current dive.
    """

    def __init__(
        self, root: Path, file: VehicleFile | None, clock: Clock, say: Callable[[str], None]
    ) -> None:
        self._root, self._name = root, (file.configuration or "") if file else ""
        self._about = about_vehicle(file, self._name) if file else About()
        self._clock, self._frames, self._say = EvenClock(clock), _Frames(), say
        self.finished: Path | None = None
        self.folder, self.began_s = self._new(), clock.boot_s()

        def notice(said: Notice) -> None:
            say(f"{said.level}: {said.sentence}")

        self._recorder = Recorder(
            [self._frames], self._opener(self.folder), clock, self.free_bytes, notice, None, None
        )
        self._stop = threading.Event()
        self._syncer = threading.Thread(target=self._sync, name="seatrial-sync", daemon=True)
        self._syncer.start()

    def keep(self, frame: Frame) -> None:
        """Take a frame that passed, in either direction."""
        self._frames.waiting.append(frame.raw)

    def step(self) -> None:
        """Write the frames that have come."""
        self._recorder.step(0.0)

    def go_on(self) -> None:
        """Begin the next dive in a new folder, between two frames. Raises LogError if no folder can be made."""
        following = self._new()
        try:
            self._recorder.go_on(self._opener(following), partial(self._change, following))
        except LogError:
            following.discard()
            raise

    def close(self) -> None:
        """End the recording."""
        self._stop.set()
        self._syncer.join()
        self._recorder.close()
        self._over(self._recorder.count)

    def free_bytes(self) -> int:
        """Free space on the disk."""
        return self.folder.free_bytes()

    def unix_s(self) -> float:
        """Current time on the clock of the recording's stamps, which follows no change of the computer's clock."""
        return self._clock.unix_s()

    def words(self) -> str:
        """Describe the progress: folder, duration, number of frames and disk space left."""
        span_s = max(self._clock.boot_s() - self.began_s, 1e-3)
        rate = self._recorder.recorded_bytes / span_s if span_s >= TELL_RATE_AFTER_S else 0.0
        free = self.free_bytes()
        left = f"{free / rate / 3600:.0f} h of disk left" if rate > 0 else f"{free / 1e9:.1f} GB of disk left"
        return f"recording into {self.folder.path}: {progress(span_s, self._recorder.recorded, left)}"

    def _new(self) -> DiveFolder:
        folder = new_folder(self._root, self._clock.unix_s(), self._name)
        folder.describe(self._about)
        return folder

    def _opener(self, folder: DiveFolder) -> Callable[[int], TlogWriter]:
        return partial(folder.open_telemetry, about=self._about)

    def _change(self, following: DiveFolder, count: Count) -> None:
        self._over(count)
        self.folder, self.began_s = following, self._clock.boot_s()
        self._say(self.words())

    def _over(self, count: Count) -> None:
        """Say how much the finished dive holds; discard its folder if nothing was heard."""
        if not count.heard:
            self.folder.discard()
            self._say("nothing passed in this dive, and no dive folder is kept")
            return
        self.finished = self.folder.path
        lost = f", {count.lost} lost here" if count.lost else ""
        lost += f", {count.moved} moved elsewhere" if count.moved else ""
        size = f"{count.frames} frames, {count.bytes / 1e3:.0f} kB"
        self._say(f"recorded {size}{lost}: {self.finished}")

    def _sync(self) -> None:
        while not self._stop.wait(SYNC_EVERY_S):
            self._recorder.sync()


def progress(span_s: float, frames: int, left: str) -> str:
    """Format as `00:12:31, 1234 frames, 41 h of disk left`."""
    clock = f"{int(span_s) // 3600:02d}:{int(span_s) // 60 % 60:02d}:{int(span_s) % 60:02d}"
    return f"{clock}, {frames} frames, {left}"
