"""Switch the feed-forward over a link: frames in, messages out, until it is done or may stop."""

import threading
from collections.abc import Callable
from typing import Final

from bridge.clock import Clock
from bridge.errors import LinkError
from bridge.exit_codes import UsageError
from bridge.links.link import Link
from bridge.wire.framing import Encoder, Framer
from gcs_plugin.feedforward import Switch
from gcs_plugin.off_orders import OffMarks
from gcs_plugin.peers import GROUND_STATION, Peers, ground_heartbeat
from tui.recording import StatusTexts

POLL_S: Final = 0.02
BEAT_EVERY_S: Final = 1.0
REOPEN_EVERY_S: Final = 0.5

Tell = Callable[[str], None]


class Line:
    """A link with a switch on it; `tell` gets the texts of vehicles."""

    def __init__(self, link: Link, clock: Clock, switch: Switch, system: int | None, tell: Tell) -> None:
        self._link, self._clock, self._switch, self._system = link, clock, switch, system
        self._framer, self._encoder, self._peers = Framer(), Encoder(*GROUND_STATION), Peers(link)
        self._texts, self._marks = StatusTexts(tell), OffMarks()
        self._beat_s = clock.boot_s()

    def step(self) -> None:
        """Send the messages due and take the frames that have come. Raises LinkError if the link is lost."""
        now_s = self._clock.boot_s()
        # Two vehicles seen once stay reported: drifting sequence numbers can hide them for a while.
        self._switch.twins = self._switch.twins or self._peers.fault(self._system)
        messages = self._switch.tick(now_s)
        if not self._switch.heard and now_s >= self._beat_s:
            # A vehicle that listens on UDP learns the ground's address from this.
            self._beat_s = now_s + BEAT_EVERY_S
            messages.append(ground_heartbeat())
        self._marks.mark(messages)
        for message in messages:
            self._link.write(self._encoder.encode(message))
        for frame in self._framer.feed(self._link.read(POLL_S)):
            arrived_s = self._clock.boot_s()
            self._peers.on_frame(frame, self._link.name, arrived_s)
            self._switch.on_frame(frame, arrived_s)
            self._texts.hear(frame)

    def close(self) -> None:
        self._link.close()


def drive(line: Line, over: Callable[[], bool]) -> None:
    """Step until `over`. Raises LinkError if the link is lost."""
    while not over():
        line.step()


def drive_on(line: Line, over: Callable[[], bool], again: Callable[[], Line], tell: Tell) -> None:
    """Step until `over`, through every loss of the link, then close it; `tell` gets the reason for each loss."""
    pause, reported = threading.Event(), ""
    now: Line | None = line
    try:
        while not over():
            if now is None:
                pause.wait(REOPEN_EVERY_S)
                now = _opened(again)
                continue
            try:
                now.step()
            except LinkError as error:
                now.close()
                now = None
                if str(error) != reported:
                    reported = str(error)
                    tell(reported)
    finally:
        if now is not None:
            now.close()


def _opened(again: Callable[[], Line]) -> Line | None:
    """Open another line; None if that is not possible yet."""
    try:
        return again()
    except (LinkError, UsageError):
        return None
