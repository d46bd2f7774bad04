"""The engine: a thread that reads a link, feeds the watcher, throws the off switch, and keeps the newest picture.

The app takes the newest picture and never waits: a slow thread makes fewer pictures, and a dead thread's picture
ages. A lost link is opened again.
"""

import threading
from collections.abc import Callable
from typing import Final

from bridge.clock import Clock
from bridge.links.link import Link
from bridge.links.reconnecting import Aside, Reconnecting
from bridge.vehicle.mode import Mode
from bridge.wire.framing import Encoder, Frame, Framer
from gcs_plugin.feedforward.off_orders import OffMarks
from gcs_plugin.feedforward.switch import Switch
from gcs_plugin.peers import GROUND_STATION, KnownVehicle
from gcs_plugin.recording.state import Holding
from gcs_plugin.watch.watcher import Watcher
from tui.app.view import Forcing, View

WAIT_S: Final = 0.05
LOOK_FOR_RECORDING_S: Final = 1.0
SHOW_DONE_S: Final = 10.0
STOP_S: Final = 2.0


class LinkSource:
    """A link, opened by `factory` in another thread, and opened again whenever it is lost.

    It keeps the name `name`: a replacement link uses it too, so that no lost link remains in the picture. `refused`
    gives the remedy if a signed link accepts no frames. With `silent`, nothing is ever sent.
    """

    def __init__(
        self,
        factory: Callable[[], Link],
        name: str,
        clock: Clock,
        refused: Callable[[], str] = lambda: "",
        *,
        silent: bool = False,
    ) -> None:
        self._clock, self._name, self._refused, self._silent = clock, name, refused, silent
        self._link = Reconnecting(Aside(factory, name), clock, name)
        self._framer = Framer()

    @property
    def trouble(self) -> str:
        """Why no frames arrive, "" while the link works."""
        return self._link.fault or self._refused()

    def frames(self) -> list[tuple[float, str, Frame]]:
        """Frames received since the last call, with arrival time and link; waits briefly for the first."""
        data = self._link.read(WAIT_S)
        now_s = self._clock.boot_s()
        return [(now_s, self._name, frame) for frame in self._framer.hear(data, now_s)]

    def send(self, data: bytes) -> None:
        """Send all of `data`, or drop it while the link is down."""
        if not self._silent:
            self._link.write(data)

    def close(self) -> None:
        self._link.close()


class Station:
    """Thread that reads the link, keeps the newest picture, and sends OFF.

    `recording` returns the running recording at a Unix time; `make_switch` makes an off switch for the vehicles
    heard so far; times are by `clock`.
    """

    def __init__(
        self,
        source: LinkSource,
        watcher: Watcher,
        clock: Clock,
        recording: Callable[[float], Holding | None],
        make_switch: Callable[[tuple[KnownVehicle, ...]], Switch],
        period_s: float = 0.25,
    ) -> None:
        self._source, self._watcher, self._clock = source, watcher, clock
        self._find_recording, self._make_switch = recording, make_switch
        self._period_s = period_s
        self._encoder = Encoder(*GROUND_STATION)
        self._thrown = threading.Event()
        self._next: tuple[LinkSource, Watcher] | None = None
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="station", daemon=True)
        self._marks = OffMarks()
        self._switch: Switch | None = None
        self._done_s: float | None = None
        self._due_s = self._look_s = clock.boot_s()
        self._recording: Holding | None = None
        self._forcing: Forcing | None = None
        self._newest = watcher.picture(clock.boot_s())

    def start(self) -> None:
        self._thread.start()

    def stop(self) -> None:
        """Stop reading and close the link; the recorder goes on. A hanging link is left alone."""
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join(STOP_S)
        if not self._thread.is_alive():
            self._source.close()
        self._watcher.close()

    def view(self) -> View:
        picture = self._newest
        return View(
            picture,
            self._clock.unix_s(),
            self._recording,
            self._forcing,
            max(0.0, self._clock.boot_s() - picture.now_s),
            self._source.trouble,
        )

    def change(self, source: LinkSource, watcher: Watcher) -> None:
        """Go on with another link, and forget the vehicles heard by the one before."""
        self._next = (source, watcher)

    def set_period(self, period_s: float) -> None:
        self._period_s = period_s

    def force_off(self) -> None:
        self._thrown.set()

    def turn(self) -> None:
        """Read once, send due messages, and make a picture if it is time."""
        if self._next is not None:
            if self._thrown.is_set():
                # Those whom this link has heard are reached by it, and known nowhere else.
                self._force(self._clock.boot_s())
            self._source.close()
            self._watcher.close()
            (self._source, self._watcher), self._next = self._next, None
        frames = self._source.frames()
        now_s = self._clock.boot_s()
        for arrived_s, link, frame in frames:
            self._watcher.feed(frame, arrived_s, link)
            if self._switch is not None:
                self._switch.on_frame(frame, arrived_s)
        self._force(now_s)
        if now_s >= self._look_s:
            self._look_s = now_s + LOOK_FOR_RECORDING_S
            self._recording = self._find_recording(self._clock.unix_s())
        if now_s >= self._due_s:
            self._due_s = now_s + self._period_s
            self._newest = self._watcher.picture(now_s)

    def _force(self, now_s: float) -> None:
        """Throw the switch, and tick it until the vehicles have confirmed that they are off."""
        if self._thrown.is_set():
            self._thrown.clear()
            if self._switch is None or self._switch.done:
                self._switch, self._done_s = self._make_switch(self._watcher.peers.known(now_s)), None
            else:
                self._switch.again()
        switch = self._switch
        if switch is None:
            return
        switch.twins = self._newest.twins
        messages = switch.tick(now_s)
        self._marks.mark(messages)
        for message in messages:
            self._source.send(self._encoder.encode(message))
        self._forcing = Forcing(switch.words, switch.sent, switch.done, switch.waits_for)
        if not switch.done:
            self._done_s = None
        elif self._done_s is None:
            self._done_s = now_s
        elif now_s > self._done_s + SHOW_DONE_S or self._acts_since(self._done_s):
            self._switch = self._forcing = None

    def _acts_since(self, done_s: float) -> bool:
        """Whether the vehicle on screen says another mode than OFF since it was off: then that is what is shown."""
        return self._newest.now_s > done_s and self._newest.ff_mode not in (None, Mode.OFF)

    def _run(self) -> None:
        while not self._stop.is_set():
            self.turn()
