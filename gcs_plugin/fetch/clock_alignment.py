"""Put a recording on the clock of another by the frames that both hold, each boot of its vehicle by itself.

The difference between a frame's two stamps is smallest when the link was quickest, so the smallest difference in
every ten seconds is the offset between the clocks. A clock that was set while the vehicle ran on dates nothing. A link
that stalls and then delivers at once all that waited is told from that by what it delivers later.
"""

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from operator import itemgetter
from pathlib import Path
from typing import Final

import numpy as np

from bridge.arrays import Array
from bridge.errors import LogError
from bridge.wire.clock_line import ClockLine, fit_clock

BLOCK_US: Final = 10_000_000
BACK_US: Final = 50_000
"""A recorder whose clock runs on never stamps a frame this much earlier than the frame before."""
LEAP_US: Final = 200_000
"""A longer time without a frame may mean that the clock was set ahead, or that the link stalled; within this time it
then delivers all that waited."""
STEP_US: Final = 250_000
"""A smaller step can't be distinguished from a late link."""
EARLY_US: Final = 30_000_000
"""How far an offset may lie below the median of its ten seconds, as links delay frames. Beyond it, the match is a
different frame with the same bytes."""
COMPARED: Final = 20
"""Number of common frames compared on each side of a step, at most; the clock offset is their median."""
JITTER_S: Final = 2e-3
"""Least standard error of the median offset of ten seconds."""


@dataclass(frozen=True)
class Kept:
    """A frame of a recording: its number in it, the boot in the name of its file, its stamp in Unix microseconds by
    the recording's own clock, and its bytes."""

    number: int
    boot: int
    stamp_us: int
    raw: bytes


@dataclass(frozen=True)
class Anchor:
    """A frame that both recordings have: its index in the first, and how much later the second stamps it."""

    place: int
    ahead_us: int


@dataclass(frozen=True)
class OneClock:
    """When each frame was sent by the other clock, in us, never running back.

    `clock`: line of this clock against the other, from the boot with the most frames in common. `guessed`: number of
    frames in boots without a common frame; such a boot is placed at the end of the one before.
    """

    dated: list[int]
    clock: ClockLine
    guessed: int


@dataclass(frozen=True)
class _Offsets:
    """How far the other clock is ahead at times of this one, in us, each array (n,) over blocks of ten seconds.

    `least` is the smallest offset in a block, `usual` the median. The least dates frames that were stamped before
    they were sent; if both sides stamped frames on arrival, each link is late as often as the other. `count`: number
    of frames.
    """

    least_at_us: Array
    least_us: Array
    usual_at_us: Array
    usual_us: Array
    count: int

    @property
    def line(self) -> ClockLine:
        """Line of how far this clock is ahead of the other, over the other's time."""
        here_s, ahead_s = (self.usual_at_us + self.usual_us) * 1e-6, -self.usual_us * 1e-6
        return fit_clock(here_s, ahead_s, np.full(len(here_s), JITTER_S))

    def by_other(self, stamp_us: Array) -> Array:
        """Convert times (n,) to the other clock; extrapolate by the drift outside the common frames."""
        nearest_us = np.clip(stamp_us, self.least_at_us[0], self.least_at_us[-1])
        ahead_us = np.interp(nearest_us, self.least_at_us, self.least_us)
        return stamp_us + ahead_us - self.line.drift * (stamp_us - nearest_us)


def put_on(kept: Sequence[Kept], anchors: Sequence[Anchor], file: Path) -> OneClock:
    """Date the frames of a recording, in recorded order, by another recording's clock.

    `anchors`, at least one, rise by place; `file` is the recording's name. Raises LogError if its clock was set.
    """
    stamps = np.array([item.stamp_us for item in kept], np.float64)
    cuts = [place for place in range(1, len(kept)) if kept[place].boot != kept[place - 1].boot]
    dated, known, strange = np.full(len(kept), np.nan), [], []
    for begins, ends in pairwise([0, *cuts, len(kept)]):
        common = _between(anchors, begins, ends)
        # A vehicle stamps its own frames before any link can hold them.
        held_us = np.zeros(ends - begins) if kept[begins].boot else _held(stamps[begins:ends])
        prompt = [anchor for anchor in common if not held_us[anchor.place - begins]]
        if 2 * len(prompt) < len(common):  # a pause before nearly every frame is no stall
            prompt, held_us = list(common), np.zeros(ends - begins)
        _refuse_steps(kept, range(begins + 1, ends), prompt, file)
        if prompt:
            known.append(_offsets(kept, prompt))
            on_time_us = known[-1].by_other(stamps[begins:ends])
            dated[begins:ends] = on_time_us - _late(on_time_us, stamps, common, begins, held_us)
        else:
            strange.append((begins, ends))
    for begins, ends in strange:
        dated[begins:ends] = _guessed(stamps[begins:ends], dated[:begins], dated[ends:])
    # No recording has a time before 1970, and a recorder whose clock stands there may have heard the last frame
    # first.
    rising = np.maximum.accumulate(np.maximum(dated, 0.0))
    line = max(known, key=lambda offset: offset.count).line
    return OneClock([round(item) for item in rising.tolist()], line, sum(b - a for a, b in strange))


def _held(stamps: Array) -> Array:
    """For arrivals (n,) in us: how long a link that stalled may have held each; 0 for one that no stall can have held.

    Such a link delivers at once all that waited.
    """
    passed_us = np.diff(stamps, prepend=stamps[0])
    first = np.maximum.accumulate(np.where(passed_us > LEAP_US, np.arange(len(stamps)), 0))
    since_us = stamps - stamps[first]
    return np.where((first > 0) & (since_us <= LEAP_US), since_us + passed_us[first], 0.0)


def _late(on_time_us: Array, stamps: Array, anchors: Sequence[Anchor], begins: int, held_us: Array) -> Array:
    """How long a stalled link held each frame of a piece (n,), in us.

    `on_time_us`: when each was sent had none been held. A frame was sent no later than the other recorder heard it.
    """
    waited = [anchor for anchor in anchors if held_us[anchor.place - begins]]
    if not waited:
        return np.zeros(len(held_us))
    places = np.array([anchor.place - begins for anchor in waited])
    heard_us = stamps[places + begins] + [anchor.ahead_us for anchor in waited]
    late_us = np.clip(on_time_us[places] - heard_us, 0.0, held_us[places])
    beside_us: Array = np.interp(np.arange(len(held_us)), places, late_us)
    return np.minimum(beside_us, held_us)


def _guessed(stamps: Array, before: Array, after: Array) -> Array:
    """Date a piece without common frames: it begins at the end of the piece before and ends before the next."""
    begins_us = np.nanmax(before, initial=-np.inf)
    ends_us = np.nanmin(after, initial=np.inf)
    begins_us = begins_us if np.isfinite(begins_us) else ends_us
    return np.minimum(begins_us + np.maximum.accumulate(stamps - stamps[0]).clip(0.0), ends_us)


def _refuse_steps(kept: Sequence[Kept], boot: range, anchors: Sequence[Anchor], file: Path) -> None:
    """Raise LogError if the clock was set while the vehicle ran on: nothing can be dated by it.

    `boot`: the places of a boot after its first; `anchors`: its own. The next boot may stand on another clock.
    """
    places = [frame.place for frame in anchors]
    for place in boot:
        passed_us = kept[place].stamp_us - kept[place - 1].stamp_us
        if not -BACK_US <= passed_us <= LEAP_US:
            middle = bisect_left(places, place)
            earlier = anchors[max(0, middle - COMPARED) : middle]
            later = anchors[middle : middle + COMPARED]
            # Common frames after the step were sent after those before it.
            by_us = _middle_us(later) - _middle_us(earlier) if earlier and later else -min(passed_us, 0)
            if abs(by_us) > STEP_US and passed_us + by_us > -STEP_US:
                raise LogError(
                    f"{file}: its clock was set by {-by_us * 1e-6:+.1f} s while it was recorded, so that nothing can "
                    "be dated by it; nothing is put together"
                )


def _between(anchors: Sequence[Anchor], begins: int, ends: int) -> Sequence[Anchor]:
    first = bisect_left(anchors, begins, key=lambda anchor: anchor.place)
    return anchors[first : bisect_left(anchors, ends, key=lambda anchor: anchor.place)]


def _offsets(kept: Sequence[Kept], anchors: Sequence[Anchor]) -> _Offsets:
    blocks: dict[int, list[tuple[int, int]]] = defaultdict(list)
    for anchor in anchors:
        stamp_us = kept[anchor.place].stamp_us
        blocks[stamp_us // BLOCK_US].append((anchor.ahead_us, stamp_us))
    usual = [
        (np.median([ahead_us for ahead_us, _ in block]), np.mean([at_us for _, at_us in block]))
        for block in blocks.values()
    ]
    least = sorted(
        (
            min(anchor for anchor in block if anchor[0] >= middle_us - EARLY_US)
            for block, (middle_us, _) in zip(blocks.values(), usual, strict=True)
        ),
        key=itemgetter(1),
    )
    return _Offsets(
        np.array([at_us for _, at_us in least], np.float64),
        np.array([ahead_us for ahead_us, _ in least], np.float64),
        np.array([at_us for _, at_us in usual], np.float64),
        np.array([ahead_us for ahead_us, _ in usual], np.float64),
        len(anchors),
    )


def _middle_us(anchors: Sequence[Anchor]) -> float:
    return float(np.median([anchor.ahead_us for anchor in anchors]))
