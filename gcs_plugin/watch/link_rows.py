"""The links of a picture: who sends on each, how fast, and with which losses."""

import math
from collections import deque
from typing import Final

from gcs_plugin.peers import GROUND_STATION, Peer, Peers, Source
from gcs_plugin.watch.picture import LinkRow

LOST_S: Final = 3.0
OVER_S: Final = 10.0
EVERY_S: Final = 1.0
Counts = dict[tuple[str, Source], tuple[int, int]]
"""Frames received and lost, by link and component."""


class LinkRows:
    """Rows of the components on all links. `peers` is fed by the caller, after `tick`."""

    def __init__(self, peers: Peers) -> None:
        self._peers = peers
        self._counts: deque[tuple[float, Counts]] = deque()
        self._first_s = math.inf

    def tick(self, time_s: float) -> None:
        """Note the counts once a second; call it before each frame."""
        self._first_s = min(self._first_s, time_s)
        if self._counts and time_s < self._counts[-1][0] + EVERY_S:
            return
        self._counts.append((time_s, self._now()))
        while time_s - self._counts[0][0] > OVER_S:
            self._counts.popleft()

    def rows(self, now_s: float) -> list[LinkRow]:
        """Rows of all senders of heartbeats except ground stations; of a link without any, of all its other senders."""
        counts = self._now()
        beating = {key for key in counts if self._beats(key) and not self._peer(key[1]).is_station}
        with_beats = {link for link, _ in beating}
        others = {
            (link, source)
            for link, source in counts
            if link not in with_beats and source != GROUND_STATION and not self._beats((link, source))
        }
        return [self._row(key, counts[key], now_s) for key in counts if key in beating or key in others]

    def _peer(self, source: Source) -> Peer:
        peer = self._peers.get(source)
        assert peer is not None
        return peer

    def _beats(self, key: tuple[str, Source]) -> bool:
        """Whether the component sent a heartbeat on the link."""
        return self._peer(key[1]).links[key[0]].beat_s > -math.inf

    def _row(self, key: tuple[str, Source], now: tuple[int, int], now_s: float) -> LinkRow:
        then_s, before = self._base(now_s)
        # A sender that was dropped from the table and came back counts from zero again.
        received, lost = (max(a - b, 0) for a, b in zip(now, before.get(key, (0, 0)), strict=True))
        link, source = key
        age_s = now_s - self._peer(source).links[link].beat_s
        loss = lost / (received + lost) if received + lost else 0.0
        loss = loss if self._peer(source).tells_loss else math.nan
        rate_hz = received / (now_s - then_s) if now_s > then_s else 0.0
        lost = min(age_s, now_s - self._first_s) > LOST_S
        return LinkRow(link, *source, age_s, loss, rate_hz, lost)

    def _base(self, now_s: float) -> tuple[float, Counts]:
        """The oldest counts of the last seconds; the newest of all if the links have been silent since."""
        recent = (item for item in self._counts if now_s - item[0] <= OVER_S)
        return next(recent, self._counts[-1] if self._counts else (now_s, {}))

    def _now(self) -> Counts:
        return {
            (link, peer.source): (here.received, here.lost)
            for peer in self._peers
            for link, here in peer.links.items()
        }
