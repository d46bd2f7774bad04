"""The recorder: writes the frames of its links to `.tlog` files, unbuffered, each frame as it arrives.

A file that fails never ends the recording: see `files`. Stamps follow the boot clock, paired with Unix time once at the
start, so that setting the clock mid-dive can't turn them back. `go_on` ends a dive and begins the next between two
frames, with the same links and outlet. Frames that other programs on this computer send through the outlet go out on
every link and into the file: they show later which orders the vehicle was given.
"""

import contextlib
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

from bridge.clock import Clock
from bridge.links.link import Link
from bridge.wire.framing import Encoder, Frame
from bridge.wire.redaction import carries_key
from bridge.wire.tlog import TlogWriter
from gcs_plugin.peers import CROWDED, KnownVehicle, Peers, Reception, ground_heartbeat
from gcs_plugin.recording.files import DiskLeft, Kept, RecordedFiles
from gcs_plugin.recording.link import RecordedLink
from gcs_plugin.recording.silence import SilenceTracker


@dataclass(frozen=True, slots=True)
class Notice:
    """Notice to the operator; `level` is "info", "warning" or "error"."""

    unix_us: int
    level: str
    sentence: str


@dataclass(frozen=True, slots=True)
class Recorded:
    """A recorded frame, in a file or waiting for it, with its arrival time and the name of its link."""

    unix_us: int
    link: str
    frame: Frame


@dataclass(frozen=True, slots=True)
class DiveCounts(Kept):
    """Counts of a dive, those of its files among them.

    `heard` counts the frames that arrived on the links, without those of the outlet, and all that waited for the disk
    when the dive began; `missed` the frames that never arrived, by the sequence numbers: a lower bound, since a long
    gap does not show its length. `unheard_s` is the vehicle's longest silence between two of its frames, 0 for none;
    `keeps_ring`: the vehicle reports that it keeps a recording onboard.
    """

    heard: int
    missed: int = 0
    unheard_s: float = 0.0
    keeps_ring: bool = False


SYNC_EVERY_S: Final = 0.5
"""A power loss loses the frames since the last sync, and those that arrive while it runs."""
HEARTBEAT_EVERY_S: Final = 1.0
KNOWN_EVERY_S: Final = 1.0
WAIT_S: Final = 0.1
WAIT_FOR_CLIENTS_S: Final = 0.02

KEY_STAYS: Final = (
    "a program on this computer wanted to give the vehicle a key to sign with; that is not passed on, "
    "set it up on the vehicle's own cable"
)


class Outlet(Protocol):
    """Another consumer of a recording's frames that may also send frames; neither method blocks or raises."""

    def broadcast(self, raw: bytes) -> None:
        """Take whole frames that arrived on the links."""
        ...

    def taken(self) -> list[bytes]:
        """Whole frames for the links, since the last call."""
        ...


class Recorder:
    """Records the frames of `links`. `open_file(n)` opens the n-th file of the recording, from 1.

    `free_bytes` returns the free space on the files' disk, or raises OSError; `notice` is called with notices to the
    operator; `reopen` opens a lost link again by its name, in a separate thread, so that the other links are not
    delayed; `heartbeat` is the (system, component) to send HEARTBEATs as, None for a silent recorder; `before_sync` is
    called in the thread that syncs the disk, twice a second; an OSError of it, or of `notice`, is nothing to the
    recording. `vehicles` are the vehicles that an OFF must go to, at most a second old, with times on `clock`; any
    thread may read it.
    """

    def __init__(
        self,
        links: Sequence[Link],
        open_file: Callable[[int], TlogWriter],
        clock: Clock,
        free_bytes: Callable[[], int],
        notice: Callable[[Notice], None],
        reopen: Callable[[str], Link] | None = None,
        heartbeat: tuple[int, int] | None = None,
        outlet: Outlet | None = None,
        before_sync: Callable[[], None] = lambda: None,
    ) -> None:
        self._clock = clock
        self._boot_at_start_s = clock.boot_s()
        self._unix_at_start_s = clock.unix_s()
        self._notice = notice
        self._encoder = Encoder(*heartbeat) if heartbeat else None
        self._outlet, self._before_sync = outlet, before_sync
        self._wait_s = WAIT_FOR_CLIENTS_S if outlet else WAIT_S
        self._links = [RecordedLink(link, clock, self._say, reopen) for link in links]
        self._next_beat_s = self._boot_at_start_s
        self._disk = DiskLeft(free_bytes, lambda words: self._say("warning", words), self._boot_at_start_s)
        self._files = RecordedFiles(open_file, clock, lambda: self._disk.has_room, self._say)
        self._peers, self._next_known_s, self._crowded = Peers(), self._boot_at_start_s, set[str]()
        self._twins = ""
        self.vehicles: tuple[KnownVehicle, ...] = ()
        self.heard = self._missed_before = 0
        self._silence = SilenceTracker()

    def add(self, link: Link) -> None:
        """Record a further link, which is not opened again; in the thread of `step`."""
        self._links.append(RecordedLink(link, self._clock, self._say))

    @property
    def receptions(self) -> dict[str, list[Reception]]:
        """Frames received and lost of each component, by link."""
        now_s = self._clock.boot_s()
        return {link.name: self._peers.receptions(link.name, now_s) for link in self._links}

    @property
    def kept(self) -> Kept:
        """Counts of the files of the present dive; any thread may read them."""
        return self._files.kept

    @property
    def unwritten(self) -> str:
        """Why frames are still waiting to be written, in a sentence; "" if none is waiting."""
        return self._files.unwritten

    @property
    def waiting(self) -> int:
        """Number of frames that wait in memory."""
        return self._files.waiting

    @property
    def lost_here(self) -> int:
        """Number of datagrams that this computer dropped before they could be read, on all links."""
        return sum(link.lost_here for link in self._links)

    @property
    def disk_left_s(self) -> float:
        """Time until the disk is full at the recent rate, s; inf if nothing arrives."""
        return self._disk.left_s

    @property
    def count(self) -> DiveCounts:
        return self._count(self._files.kept)

    def unix_us(self) -> int:
        """Present time on the recording's clock, Unix µs; never runs back."""
        return round((self._unix_at_start_s + self._clock.boot_s() - self._boot_at_start_s) * 1e6)

    def step(self, timeout_s: float) -> list[Recorded]:
        """Record the frames that the links have, waiting up to `timeout_s` if they have none; return these frames."""
        self._files.change()
        received = [item for link in self._links for item in self._read(link, 0.0)]
        alive = [link for link in self._links if link.is_there]
        if not received and timeout_s > 0:
            for link in alive:
                received += self._read(link, timeout_s / len(alive))
        self._beat()
        self._serve(received)
        self._files.drain()
        for link in self._links:
            link.look()
        now_s = self._clock.boot_s()
        self._disk.look(now_s)
        if now_s >= self._next_known_s:
            self._next_known_s, self.vehicles = now_s + KNOWN_EVERY_S, self._peers.known(now_s)
            self._tell_crowds()
            self._tell_twins()
        return received

    def go_on(self, open_file: Callable[[int], TlogWriter], changed: Callable[[DiveCounts], None]) -> None:
        """Begin the next dive with the next `step`, in files of `open_file`; may be called from another thread.

        `changed` is called in the thread of `step` with the counts of the dive that ended. Raises LogError if the first
        file can't be opened, or if a next dive is already pending: then nothing changes.
        """
        self._files.go_on(open_file, lambda kept: changed(self._over(kept)))

    def sync(self) -> None:
        """Sync the written frames to the disk; call it from another thread than `step`."""
        self._files.sync()

    def close(self) -> None:
        """Write the waiting frames, and close files and links."""
        self._files.change()
        for link in self._links:
            for frame in link.flush():
                self._keep(link, frame)
        self._files.close()
        for link in self._links:
            link.close()

    def run(self, stop: threading.Event) -> None:
        """Record until `stop` is set, then close; another thread syncs the disk twice a second."""
        end_sync = self.begin_sync(stop)
        try:
            while not stop.is_set():
                idle = not any(link.is_there for link in self._links)
                self.step(self._wait_s)
                if idle:
                    stop.wait(self._wait_s)
        finally:
            end_sync()
            self.close()

    def begin_sync(self, stop: threading.Event | None = None) -> Callable[[], None]:
        """Begin to sync the disk in a thread of its own; the function returned ends that, and sets `stop`."""
        ended = stop or threading.Event()
        thread = threading.Thread(target=self.sync_until, args=(ended,), name="recorder-sync", daemon=True)
        thread.start()

        def end() -> None:
            ended.set()
            thread.join()

        return end

    def sync_until(self, stop: threading.Event) -> None:
        """Sync the disk twice a second until `stop` is set; in another thread than `step`."""
        while not stop.wait(SYNC_EVERY_S):
            # Before any access to the disk: a disk that stalls would make a running recording look dead.
            with contextlib.suppress(OSError):
                self._before_sync()
            self.sync()

    def _over(self, kept: Kept) -> DiveCounts:
        """Counts of the dive that ended; resets the counts for the next dive."""
        count = self._count(kept)
        # What the disk would not take yet goes into the next dive's files: that dive is not empty.
        self.heard = self._files.waiting
        self._missed_before, self._silence = self._peers.lost(), SilenceTracker()
        return count

    def _count(self, kept: Kept) -> DiveCounts:
        missed = max(0, self._peers.lost() - self._missed_before)
        silence = round(self._silence.longest_s, 3), self._silence.keeps_ring
        return DiveCounts(kept.files, kept.frames, kept.bytes, kept.lost, self.heard, missed, *silence)

    def _tell_crowds(self) -> None:
        for link in self._peers.left_out:
            if link not in self._crowded:
                self._crowded.add(link)
                self._say(
                    "warning",
                    f"{link}: {CROWDED}; all is recorded; loss and age are shown only for components in the table",
                )

    def _tell_twins(self) -> None:
        before, self._twins = self._twins, self._peers.fault()
        if self._twins and not before:
            self._say(
                "warning", f"{self._twins}; their messages are mixed in this recording, and tell of neither"
            )

    def _read(self, link: RecordedLink, timeout_s: float) -> list[Recorded]:
        return [self._keep(link, frame) for frame in link.read(timeout_s)]

    def _keep(self, link: RecordedLink, frame: Frame) -> Recorded:
        now_s = self._clock.boot_s()
        peer = self._peers.on_frame(frame, link.name, now_s)
        if peer is not None:
            self._silence.on_frame(peer, frame, now_s)
            if peer.restart is not None:
                self._say("warning", peer.restart.words(self._unix_at_start_s - self._boot_at_start_s))
        self.heard += 1
        self._disk.came(len(frame.raw))
        return Recorded(self._store(frame.raw), link.name, frame)

    def _store(self, raw: bytes) -> int:
        """Write a frame to the file; return its stamp."""
        stamp_us = self.unix_us()
        self._files.put(stamp_us, raw)
        return stamp_us

    def _serve(self, received: Sequence[Recorded]) -> None:
        """Pass the frames to the outlet; send, then store, the frames that it has: no order waits for a disk."""
        if self._outlet is None:
            return
        if received:
            self._outlet.broadcast(
                b"".join(item.frame.raw for item in received if not carries_key(item.frame.raw))
            )
        for raw in self._outlet.taken():
            if carries_key(raw):
                self._say("warning", KEY_STAYS)
                continue
            self._send(raw)
            self._store(raw)

    def _beat(self) -> None:
        if self._encoder is None or self._clock.boot_s() < self._next_beat_s:
            return
        self._next_beat_s = self._clock.boot_s() + HEARTBEAT_EVERY_S
        self._send(self._encoder.encode(ground_heartbeat()))

    def _send(self, raw: bytes) -> None:
        for link in self._links:
            link.send(raw)

    def _say(self, level: str, sentence: str) -> None:
        # Where the crew's terminal has gone, or its log lies on the disk that is full, the recording goes on.
        with contextlib.suppress(OSError):
            self._notice(Notice(self.unix_us(), level, sentence))
