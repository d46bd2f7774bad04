"""Ways to feed a stream of bytes to a parser, and the checks that hold for each."""

import random
from collections.abc import Callable, Iterable, Iterator

from bridge.sensors.samples import Parser, Sample

Make = Callable[[], Parser]


def fed(parser: Parser, chunks: Iterable[bytes], time_s: float = 10.0) -> list[Sample]:
    """All samples of a stream that arrives in `chunks` at one instant."""
    return [sample for chunk in chunks for sample in parser.feed(chunk, time_s)]


def bytewise(data: bytes) -> Iterator[bytes]:
    return (data[i : i + 1] for i in range(len(data)))


def splits(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Every way to cut `data` into two, the empty ones included."""
    return ((data[:i], data[i:]) for i in range(len(data) + 1))


def random_chunks(data: bytes, rng: random.Random, longest: int = 40) -> Iterator[bytes]:
    at = 0
    while at < len(data):
        size = rng.randint(1, longest)
        yield data[at : at + size]
        at += size


def flips(data: bytes) -> Iterator[bytes]:
    """`data` with each of its bits turned over once."""
    for i in range(len(data)):
        for bit in range(8):
            yield data[:i] + bytes((data[i] ^ (1 << bit),)) + data[i + 1 :]


def largest_buffer(
    make: Make, rng: random.Random, alphabet: bytes | None = None, total: int = 100_000
) -> int:
    """The most bytes that a parser held on to while `total` bytes of noise went through it."""
    parser, largest = make(), 0
    noise = bytes(rng.choices(alphabet, k=total)) if alphabet else rng.randbytes(total)
    for number, chunk in enumerate(random_chunks(noise, rng, 200)):
        parser.feed(chunk, number * 0.001)
        largest = max(largest, _held(parser))
    return largest


def _held(holder: object) -> int:
    """The bytes that an object keeps, also within its own parts."""
    if isinstance(holder, bytes | bytearray):
        return len(holder)
    return sum(map(_held, vars(holder).values())) if type(holder).__module__.startswith("bridge.") else 0
