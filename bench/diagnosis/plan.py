"""Which dives are diagnosed: how many of each kind, by which seeds.

All seeds are of a range that nothing is tuned on; development has seeds of its own (300000 to 399999).
"""

from collections.abc import Sequence
from dataclasses import dataclass

from identify.challenge.case import UNSEEN_BESIDE, Case, Kind, draw_case, left_out
from identify.challenge.novel import NOVEL
from identify.challenge.plants import PLANTS

NONE, ONE, TWO, STRANGE, LACKING, POWER, SPEED = (500_000 + 10_000 * k for k in range(7))
"""The first seed of each kind."""

UNKNOWABLE = tuple(name for name in PLANTS if name not in UNSEEN_BESIDE)
"""What is planted once more, left out of the library with its true class."""


@dataclass(frozen=True)
class Planned:
    """One dive. names: what it hides, drawn where None; left: the effect that the library lacks, if one."""

    group: str
    seed: int
    kind: Kind
    names: tuple[str, ...] | None = None
    left: str = ""

    @property
    def name(self) -> str:
        return f"{self.group} {self.seed}"

    def case(self) -> Case:
        without = left_out(self.left) if self.left else ()
        return draw_case(self.seed, name=self.name, kind=self.kind, names=self.names, without=without)


@dataclass(frozen=True)
class Counts:
    """How many dives: without an effect; of each effect alone; of two; of each that no library has; of those left out
    of the library, each once, so many in all."""

    none: int
    each: int
    two: int
    strange: int
    lacking: int


FULL = Counts(300, 8, 100, 6, len(UNKNOWABLE))
SHORT = Counts(8, 1, 8, 1, 4)


def planned(counts: Counts) -> list[Planned]:
    """All dives of the section."""
    alone = [name for name in PLANTS for _ in range(counts.each)]
    strange = [name for name in NOVEL for _ in range(counts.strange)]
    return [
        *(Planned("none", NONE + i, "none") for i in range(counts.none)),
        *_of_names("one", ONE, "one", alone),
        *(Planned("two", TWO + i, "two") for i in range(counts.two)),
        *_of_names("novel", STRANGE, "novel", strange),
        *(
            Planned("left out", LACKING + i, "novel", (name,), name)
            for i, name in enumerate(UNKNOWABLE[: counts.lacking])
        ),
    ]


def power_planned(each: int) -> list[Planned]:
    """`each` dives of every effect alone."""
    return _of_names("power", POWER, "one", [name for name in PLANTS for _ in range(each)])


def _of_names(group: str, first: int, kind: Kind, names: Sequence[str]) -> list[Planned]:
    return [Planned(group, first + i, kind, (name,)) for i, name in enumerate(names)]
