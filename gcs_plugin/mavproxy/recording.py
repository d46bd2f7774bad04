# SPDX-License-Identifier: GPL-3.0-or-later
"""A recording of everything on MAVProxy's links, both ways, in a dive folder."""

import shutil
import threading
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Final

from bridge.clock import Clock
from bridge.errors import LinkError
from bridge.framing import Frame
from bridge.vehicle.config import VehicleFile
from gcs_plugin.folder import About, about_vehicle, new_folder
from gcs_plugin.recorder import SYNC_EVERY_S, Notice, Recorder

TELL_RATE_AFTER_S: Final = 5.0


class _Frames:
    """The link that the recorder reads: frames of all links as they passed."""

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
    """Records from its making until `close`; `say` hears of trouble. The disk is synced in a thread of its own."""

    def __init__(
        self, root: Path, file: VehicleFile | None, clock: Clock, say: Callable[[str], None]
    ) -> None:
        configuration = (file.configuration or "") if file else ""
        self.folder = new_folder(root, clock.unix_s(), configuration)
        self.folder.describe(about_vehicle(file, configuration) if file else About())
        self.began_s = clock.boot_s()
        self._clock, self._frames = clock, _Frames()

        def notice(said: Notice) -> None:
            say(f"{said.level}: {said.sentence}")

        self._recorder = Recorder(
            [self._frames], self.folder.open_telemetry, clock, self.free_bytes, notice, None, None
        )
        self._stop = threading.Event()
        self._syncer = threading.Thread(target=self._sync, name="seatrial-sync", daemon=True)
        self._syncer.start()

    def keep(self, frame: Frame) -> None:
        """A frame passed, either way."""
        self._frames.waiting.append(frame.raw)

    def step(self) -> None:
        """Write what came."""
        self._recorder.step(0.0)

    def note(self, text: str) -> None:
        """Write down what the crew says, with the time. Raises LogError."""
        self.folder.add_event(self._clock.unix_s(), text)

    def close(self) -> str:
        """End it; what was recorded, in words."""
        self._stop.set()
        self._syncer.join()
        self._recorder.close()
        lost = f", {self._recorder.lost} lost" if self._recorder.lost else ""
        size = f"{self._recorder.recorded} frames, {self._recorder.recorded_bytes / 1e3:.0f} kB"
        return f"{size}{lost}: {self.folder.path}"

    def free_bytes(self) -> int:
        """What the disk has left."""
        return shutil.disk_usage(self.folder.path).free

    def words(self) -> str:
        """How it goes."""
        span_s = max(self._clock.boot_s() - self.began_s, 1e-3)
        rate = self._recorder.recorded_bytes / span_s if span_s >= TELL_RATE_AFTER_S else 0.0
        free = self.free_bytes()
        left = f"{free / rate / 3600:.0f} h of disk left" if rate > 0 else f"{free / 1e9:.1f} GB of disk left"
        clock = f"{int(span_s) // 3600:02d}:{int(span_s) // 60 % 60:02d}:{int(span_s) % 60:02d}"
        return f"recording into {self.folder.path}: {clock}, {self._recorder.recorded} frames, {left}"

    def _sync(self) -> None:
        while not self._stop.wait(SYNC_EVERY_S):
            self._recorder.sync()
