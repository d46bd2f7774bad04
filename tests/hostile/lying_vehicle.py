"""A vehicle that is asked for its ring and answers anything; a link itself, whose read lets time pass."""

import random
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from fuzz_bytes import TELLING
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SimulatedClock
from bridge.links.link import Link
from bridge.onboard.file_server import FileServer, Segments
from bridge.wire.framing import Encoder, Framer
from bridge.wire.ftp import Fault, Op, Packet, acknowledged, decode, refused
from bridge.wire.segments import Segment
from gcs_plugin.peers import GROUND_STATION

VEHICLE = (1, 191)
FTP = dialect.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL
ASKED = (Op.LIST, Op.OPEN_READ, Op.READ, Op.CRC32)
WILD = (0, 1, 238, 239, 240, 255, 0xFFFF, 2**31, 2**32 - 1)
ABSURD = (
    b"F../../etc/passwd\t10", b"F/etc/passwd\t10", b"D..\t", b"F\t", b"F", b"\t\t\t", b"F\x1b[2J\t5", b"S",
    b"F000001-00000007-000001-0000000000.tlog/../../x\t9", b"F000001-00000007-000001-0000000000.tlog\n\t9",
    b"\xff" * 60, b"F000009-0000000g-000001-0000000000.tlog\t9", "F٠٠٠٠٠١-00000007-000001-0000000000.tlog\t9".encode(),
    b"F..\\000001-00000007-000001-0000000000.tlog\t9", b"F000001-00000007-000001-0000000000.tlog.part\t9",
    b"F999999-ffffffff-999999-9999999999.tlog\t-1", b"F999999-ffffffff-999999-9999999998.tlog\t" + b"9" * 190,
    b"F999999-ffffffff-999999-9999999997.tlog\t1e3", b"F999999-ffffffff-999999-9999999996.tlog\t5\t5",
    b"F000000-00000000-000000-0000000000.tlog\t50",
)  # fmt: skip
SIZES = (b"0", b"1", b"00000000000000000001", b"100000", b"4294967295", b"4294967296", b"1" + b"0" * 100, b"")

Lie = Callable[[Packet, Packet, random.Random], Packet]
"""The answer to a request, given the true one."""


def _listed(entries: list[bytes]) -> bytes:
    """As many of the entries as a packet holds, the rest left out."""
    data = b""
    for entry in entries:
        if len(data) + len(entry) < 239:
            data += entry + b"\0"
    return data


def _made_up(asked: Packet, _true: Packet, rng: random.Random) -> Packet:
    segment = Segment(rng.randrange(10**6), rng.getrandbits(32), rng.randrange(10**6), rng.randrange(10**10))
    return acknowledged(
        asked, _listed([f"F{replace(segment, number=n).name}\t1000".encode() for n in range(4)])
    )


def _absurd(asked: Packet, _true: Packet, rng: random.Random) -> Packet:
    return (
        acknowledged(asked, _listed(rng.sample(ABSURD, 6)))
        if asked.offset < 40
        else refused(asked, Fault.END)
    )


def _sized(asked: Packet, true: Packet, rng: random.Random) -> Packet:
    names = [entry.partition(b"\t")[0] for entry in true.data.split(b"\0") if entry]
    if true.op == Op.NAK:
        return true
    return acknowledged(asked, _listed([name + b"\t" + rng.choice(SIZES) for name in names]))


def _fault(asked: Packet, _true: Packet, rng: random.Random) -> Packet:
    return replace(refused(asked, Fault.FAIL), data=bytes((rng.randrange(256),)))


def _refusing(fault: Fault) -> Lie:
    return lambda asked, *_: refused(asked, fault)


def _saying(data: Callable[[Packet, random.Random], bytes], **other: Any) -> Lie:
    return lambda asked, _true, rng: replace(acknowledged(asked, data(asked, rng)), **other)


LIES: dict[Op, dict[str, Lie]] = {
    Op.LIST: {
        "files without end": _made_up,
        "one file again and again": _saying(lambda *_: b"F000001-00000007-000001-0000000000.tlog\t90\0"),
        "nothing, without end": _saying(lambda *_: b""),
        "entries that are none, without end": _saying(lambda *_: b"S\0" * 100),
        "an entry far beyond": _saying(lambda *_: b"S\0", offset=2**32 - 1),
        "absurd names": _absurd,
        "absurd sizes": _sized,
        "an end at once": _refusing(Fault.END),
        "any fault": _fault,
    },
    Op.OPEN_READ: {
        "any session": lambda _asked, true, rng: replace(true, session=rng.randrange(256)),
        "an end": _refusing(Fault.END),
        "any fault": _fault,
    },
    Op.READ: {
        "noise": _saying(lambda asked, rng: rng.randbytes(asked.size)),
        "a byte": lambda _asked, true, _rng: replace(true, data=true.data[:1]),
        "more than asked": _saying(lambda *_: bytes(239)),
        "nothing": _saying(lambda *_: b""),
        "bytes of elsewhere": _saying(lambda asked, _: bytes(asked.size), offset=2**32 - 1),
        "no such session": _refusing(Fault.SESSION),
        "no such session, once in a while": lambda asked, true, rng: (
            refused(asked, Fault.SESSION) if rng.random() < 0.1 else true
        ),
        "an end at once": _refusing(Fault.END),
        "gone": _refusing(Fault.NOT_FOUND),
        "any fault": _fault,
    },
    Op.CRC32: {
        "a wrong one": _saying(lambda _, rng: rng.randbytes(4)),
        "none": _saying(lambda *_: b""),
        "too long a one": lambda _asked, true, _rng: replace(true, data=true.data + b"\1" * 200),
        "gone": _refusing(Fault.NOT_FOUND),
        "any fault": _fault,
    },
}


def hurt(true: Packet, rng: random.Random) -> Packet:
    """The truth with a field or two of it changed."""
    for _ in range(rng.choice((0, 0, 1, 1, 2))):
        field = rng.choice(("sequence", "session", "op", "request", "offset", "data"))
        number = rng.choice((*WILD, rng.randrange(2**32)))
        if field == "data":
            data = bytearray(true.data or b"\0")
            data[rng.randrange(len(data))] = rng.choice(TELLING)
            cut = rng.choice((len(data), len(data), rng.randrange(len(data) + 1)))
            true = replace(true, data=bytes(data[:cut]), size=cut)
        elif field == "offset":
            true = replace(true, offset=number)
        elif field == "sequence":
            true = replace(true, sequence=rng.choice((true.sequence + 1, true.sequence - 1, number)) & 0xFFFF)
        else:
            true = replace(true, **{field: rng.choice((*Op, number)) & 0xFF})
    return true


def noise(asked: Packet, true: Packet, rng: random.Random) -> Packet:
    """Anything, but that it is said to be the answer."""
    op, data = rng.choice((Op.ACK, Op.ACK, Op.NAK)), rng.randbytes(rng.randrange(240))
    size = rng.choice((len(data), *WILD[:6]))
    offset = rng.choice((asked.offset, *WILD))
    return Packet(true.sequence, rng.randrange(256), op, size, asked.op, offset=offset, data=data)


def mutated(_asked: Packet, true: Packet, rng: random.Random) -> Packet:
    return hurt(true, rng)


class Crafted:
    """One lie, or the truth, to each kind of request, and another after a while."""

    def __init__(self) -> None:
        self.chosen: dict[int, Lie | None] = {}

    def __call__(self, asked: Packet, true: Packet, rng: random.Random) -> Packet:
        if asked.op not in self.chosen or rng.random() < 0.03:
            self.chosen[asked.op] = rng.choice((None, *LIES[Op(asked.op)].values()))
        lie = self.chosen[asked.op]
        return true if lie is None else lie(asked, true, rng)


class Vehicle(Link):
    """Answers from the ring in `folder` by way of `lie`, and nothing more once it has said `most_bytes`.

    Whoever still asks after `longest_s` hangs.
    """

    name = "memory:vehicle"

    def __init__(
        self, folder: Path, lie: Lie | None, rng: random.Random, most_bytes: float, longest_s: float
    ) -> None:
        self.world, self.said = SimulatedClock(), 0
        self._server = FileServer(Segments(folder), lambda _: 1e9)
        self._lie, self._rng, self._most, self._longest_s = lie, rng, most_bytes, longest_s
        self._framer, self._encoder = Framer(), Encoder(*VEHICLE)
        self._out: list[bytes] = []
        self._before: list[Packet] = []

    def _true(self, payload: bytes) -> Packet:
        self._server.hear((0, *GROUND_STATION), payload, self.world.boot_s())
        for _ in range(10):
            for _, answer in self._server.due(self.world.boot_s()):
                return decode(answer)
        raise AssertionError("the server answers")

    def _answers(self, payload: bytes) -> list[Packet]:
        asked, true = decode(payload), self._true(payload)
        if self._lie is None or asked.op not in ASKED:
            return [true]
        out = [self._lie(asked, true, self._rng)]
        if self._before and self._rng.random() < 0.05:  # what was said before comes again
            out.append(self._rng.choice(self._before))
        self._before = [*self._before[-9:], out[0]]
        return out

    def write(self, data: bytes) -> None:
        for frame in self._framer.feed(data):
            if frame.message_id != FTP or self.said >= self._most:
                continue
            for answer in self._answers(frame.payload[3:]):
                raw = self._encoder.frame(FTP, bytes((0, *GROUND_STATION)) + answer.encode())
                self.said += len(raw)
                self._out.append(raw)

    def read(self, timeout_s: float) -> bytes:
        self.world.advance_to(self.world.now_s + timeout_s)
        assert self.world.now_s < self._longest_s, "it never ends"
        data, self._out = b"".join(self._out), []
        return data

    def close(self) -> None:
        pass
