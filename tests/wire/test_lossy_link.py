"""A link that loses, doubles, damages, delays and reorders frames, as it is told."""

import random

import pytest

from bridge.clock import SimulatedClock
from bridge.framing import Encoder, Framer
from bridge.link.base import Link
from bridge.link.lossy import Lossy
from bridge.link.memory import memory_pair


def frames(count: int) -> list[bytes]:
    encoder = Encoder(1, 1)
    return [encoder.frame(0, bytes((i, 2, 3, 4, 5, 6, 7, 8, 9))) for i in range(count)]


def lossy_pair(**faults: float) -> tuple[Lossy, Link, SimulatedClock]:
    clock = SimulatedClock()
    near, far = memory_pair()
    return Lossy(near, random.Random(2), clock, **faults), far, clock


def drain(link: Link) -> bytes:
    data = b""
    while more := link.read(0.0):
        data += more
    return data


def through(lossy: Lossy, far: Link, raws: list[bytes]) -> tuple[list[bytes], list[bytes]]:
    """What comes out of either direction."""
    for raw in raws:
        lossy.write(raw)
        far.write(raw)
    out = [f.raw for f in Framer().feed(drain(far)) if f.known]
    back = b"".join(lossy.read(0.0) for _ in raws)
    return out, [f.raw for f in Framer().feed(back) if f.known]


def test_a_lossy_link_without_faults_changes_nothing() -> None:
    lossy, far, _ = lossy_pair()
    assert through(lossy, far, frames(50)) == (frames(50), frames(50))


@pytest.mark.parametrize(
    ("fault", "low", "high"), [("loss", 120, 160), ("duplicate", 240, 280), ("corrupt", 120, 160)]
)
def test_a_lossy_link_loses_doubles_and_damages_frames_at_its_rate_both_ways(
    fault: str, low: int, high: int
) -> None:
    lossy, far, _ = lossy_pair(**{fault: 0.3})
    for got in through(lossy, far, frames(200)):
        assert low < len(got) < high
        assert set(got) <= set(frames(200))


def test_a_lossy_link_lets_frames_overtake_each_other_and_loses_none() -> None:
    lossy, far, clock = lossy_pair(reorder=0.2)
    out, _ = through(lossy, far, frames(100))
    clock.advance_to(1.0)
    lossy.read(0.0)
    out += [f.raw for f in Framer().feed(drain(far))]
    assert out != frames(100)
    assert sorted(out) == sorted(frames(100))


def test_a_lossy_link_delays_and_its_switches_work_while_it_runs() -> None:
    lossy, far, clock = lossy_pair(delay_s=0.2)
    lossy.write(frames(1)[0])
    clock.advance_to(0.1)
    assert (lossy.read(0.0), drain(far)) == (b"", b"")
    clock.advance_to(0.2)
    lossy.read(0.0)
    assert drain(far) == frames(1)[0]
    lossy.outgoing.delay_s = 0.0
    lossy.outgoing.cut = True
    lossy.write(frames(1)[0])
    assert drain(far) == b""
    lossy.outgoing.cut = False
    lossy.write(frames(1)[0])
    assert drain(far) == frames(1)[0]
