"""Bytes as a hostile hand makes them: at random, of good ones hurt, and crafted so that every checksum is right."""

import random
from collections.abc import Callable, Iterator, Sequence
from typing import Final

KINDS: Final = ("random", "mutated", "crafted")
PIECE_BYTES: Final = 4000
TELLING: Final = (0x00, 0x01, 0x7F, 0x80, 0xFE, 0xFF, 0x0A, 0x20, 0x1B)

Craft = Callable[[random.Random], bytes]


def pieces(
    kind: str, total: int, seeds: Sequence[bytes], craft: Craft, rng: random.Random
) -> Iterator[bytes]:
    """Pieces of at least `total` bytes together."""
    made = 0
    while made < total:
        if kind == "random":
            piece = rng.randbytes(rng.randrange(1, PIECE_BYTES))
            if rng.random() < 0.5:
                # Of few different bytes, which say more to a parser than any.
                few = bytes(rng.choices(rng.choice(seeds), k=8))
                piece = bytes(rng.choices(few, k=len(piece)))
        elif kind == "mutated":
            piece = mutated(rng.choice(seeds), rng)
        else:
            piece = craft(rng)
        made += max(len(piece), 1)
        yield piece


def mutated(good: bytes, rng: random.Random) -> bytes:
    """`good` with some of its bytes turned over, replaced, taken out, put in, or said twice."""
    data = bytearray(good)
    for _ in range(rng.randrange(1, 10)):
        at, way = rng.randrange(len(data) + 1), rng.randrange(6)
        if way == 0 and at < len(data):
            data[at] ^= 1 << rng.randrange(8)
        elif way == 1 and at < len(data):
            data[at] = rng.choice(TELLING)
        elif way == 2:
            del data[at : at + rng.randrange(1, 20)]
        elif way == 3:
            data[at:at] = rng.randbytes(rng.randrange(1, 10))
        elif way == 4:
            data[at:at] = data[at : at + rng.randrange(1, 200)]
        else:
            del data[len(data) - rng.randrange(len(data) // 4 + 1) :]
    return bytes(data)
