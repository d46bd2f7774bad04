"""Checks of every parser of frames or lines: any pieces, noise around, flipped bits, bounded memory."""

import random
from collections.abc import Callable
from dataclasses import dataclass

import pytest
from sensor_streams import bytewise, fed, flips, largest_buffer, random_chunks, splits
from test_kvh1760 import FRAME, LONG_FRAME
from test_ublox import GGA, PVT, RMC
from test_waterlink import DOCUMENTED, REPORT
from test_wayfinder import LOCKED
from test_xsens import CW, GO, LONG, OURS

from bridge.sensors.kvh1760 import Kvh1760Parser
from bridge.sensors.samples import FogBlock, Parser
from bridge.sensors.ublox import UbloxParser
from bridge.sensors.waterlink import WaterlinkJsonParser, WaterlinkSerialParser
from bridge.sensors.wayfinder import WayfinderParser
from bridge.sensors.xsens import XsensParser, encode_message


@dataclass(frozen=True)
class Case:
    """A device: `message` gives one sample; `noise` looks like its beginning; `filler` ends what is held back."""

    make: Callable[[], Parser]
    message: bytes
    noise: tuple[bytes, ...]
    alphabet: bytes
    held: int
    filler: bytes = b""


XSENS_NOISE = (b"\xfa", b"\xfa\xff", b"\xfa\xff\x36", b"\xfa\xff\x36\xff\x01\x00", bytes(9), CW[:50])
KVH_NOISE = (b"\xfe", b"\xfe\x81", b"\xfe\x81\xff", b"\xfe\x81\xff\x57", bytes(9), FRAME[:30])
UBLOX_NOISE = (b"$", b"$GP", b"\xb5", b"\xb5\x62", b"\xb5\x62\x01\x07\xff\xff", b"\r\n", bytes(9))
XSENS = (XSENS_NOISE, b"\xfa\xff\x36\x07\x08", 2300, encode_message(0x30) * 450)
KVH = (KVH_NOISE, b"\xfe\x81\xff\x55\x56", 40, bytes(50))
CASES = {
    "wayfinder": Case(
        WayfinderParser,
        LOCKED,
        (b"\xaa", b"\xaa\x10", b"\xaa\x10\x01", b"\xaa\x10\x01\x62\x00", bytes(50), LOCKED[:60]),
        b"\xaa\x10\x01\x02\x0f",
        4096,
    ),
    "waterlink json": Case(WaterlinkJsonParser, REPORT, (b"{\n", b"\xff\n"), b'{}":,1', 16384),
    "waterlink serial": Case(
        WaterlinkSerialParser, DOCUMENTED["wrz"] + b"\n", (b"wrz,\n", b"*50\n"), b"wrz,1*", 1024
    ),
    "xsens CW": Case(XsensParser, CW, *XSENS),
    "xsens GO": Case(XsensParser, GO, *XSENS),
    "xsens ours": Case(XsensParser, OURS, *XSENS),
    "xsens long": Case(XsensParser, LONG, *XSENS),
    "kvh1760 A": Case(Kvh1760Parser, FRAME, *KVH),
    "kvh1760 B": Case(Kvh1760Parser, LONG_FRAME, *KVH),
    "ublox pvt": Case(UbloxParser, PVT, UBLOX_NOISE, b"\xb5\x62\x01\x03\x00", 1032, bytes(1100)),
    "ublox nmea": Case(UbloxParser, GGA + RMC, UBLOX_NOISE[:2], b"$GP,*\r1", 1032, bytes(1100)),
}
every_device = pytest.mark.parametrize("case", CASES.values(), ids=CASES)


def values(samples):
    """Values of the samples without their times, as text, in which NaN equals itself."""
    return [repr(s.rate) if isinstance(s, FogBlock) else repr(s).partition(", ")[2] for s in samples]


@every_device
def test_a_message_may_arrive_in_any_pieces(case):
    whole = case.make()
    expected = values(whole.feed(case.message, 10.0))
    assert len(expected) == 1
    for pieces in (*splits(case.message), tuple(bytewise(case.message))):
        assert values(fed(case.make(), pieces)) == expected


@every_device
def test_noise_before_between_and_after_costs_no_message(case):
    expected = values(case.make().feed(case.message, 0.0))
    for noise in case.noise:
        data = noise + case.message + noise + case.message + noise + case.filler
        assert values(fed(case.make(), bytewise(data))) == 2 * expected, noise


@every_device
def test_messages_are_found_in_random_noise_however_it_is_cut(case):
    rng, expected = random.Random(5), values(case.make().feed(case.message, 0.0))
    end = b"\n" if case.message.endswith(b"\n") else b""
    for _ in range(50):
        first, second = (rng.randbytes(rng.randint(0, 60)) + end for _ in range(2))
        stream = first + case.message + second + case.message + case.filler
        assert values(fed(case.make(), random_chunks(stream, rng))) == 2 * expected


@pytest.mark.parametrize("name", [name for name in CASES if name != "waterlink json"])
def test_no_single_flipped_bit_gives_other_values(name):
    case = CASES[name]
    good = values(case.make().feed(case.message, 0.0))
    for bad in flips(case.message):
        assert values(case.make().feed(bad + bytes(10), 0.0)) in ([], good)


@every_device
def test_memory_stays_bounded_in_noise(case):
    rng = random.Random(1)
    assert largest_buffer(case.make, rng) <= case.held
    assert largest_buffer(case.make, rng, alphabet=case.alphabet) <= case.held
