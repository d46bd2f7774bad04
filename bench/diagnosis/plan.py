"""Plan of the diagnosed dives: how many of each kind, and their seeds.

All seeds are of a range that nothing is tuned on; development has seeds of its own (300000 to 399999).
"""

from collections.abc import Sequence
from dataclasses import dataclass

from identify.challenge.case import UNDETECTABLE, Case, Kind, draw_case, left_out
from identify.challenge.novel_effects import NOVEL
from identify.challenge.planted_effects import ABSORBED, PLANTS

BENCH, POWER_BENCH, DEVELOPMENT = 1_200_000, 500_000, 390_000
"""First seeds of the section, of its power curves, and of the short form, which anyone may look at.

Seeds from 500000, 700000, 900000 and 1100000 on have been looked at: the section has those from 1200000 on.
"""

NONE, ONE, TWO, NOVEL_KINDS, LACKING, SPEED, POWER = (1000 * k for k in range(7))
"""Offset of each group's seeds from the first; power comes last, because it has the most."""

LACKED = tuple(name for name in PLANTS if name not in UNDETECTABLE)
"""Effects that are planted once more while the library lacks them and their true class."""


@dataclass(frozen=True)
class Planned:
    """One dive. names: its hidden effects, drawn if None; left: the effect that the library lacks, "" for none."""

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
    """Numbers of dives.

    none: without an effect; each: of each effect alone; two: with two effects; novel: of each effect that no library
    has; lacking: of effects left out of the library, one dive each; power: of each effect alone, for its power.
    first: the first seed.
    """

    first: int
    none: int
    each: int
    two: int
    novel: int
    lacking: int
    power: int


FULL = Counts(BENCH, 300, 4, 100, 6, len(LACKED), 90)
SHORT = Counts(DEVELOPMENT, 8, 1, 8, 1, 4, 2)


def planned(counts: Counts) -> list[Planned]:
    """All dives of the section, without those of the power curves."""
    first = counts.first
    alone = [name for name in PLANTS for _ in range(counts.each)]
    novel = [name for name in NOVEL for _ in range(counts.novel)]
    lacking = LACKED[: counts.lacking]
    return [
        *(Planned("none", first + NONE + i, "none") for i in range(counts.none)),
        *_of_names("one", first + ONE, "one", alone),
        *(Planned("two", first + TWO + i, "two") for i in range(counts.two)),
        *_of_names("novel", first + NOVEL_KINDS, "novel", novel),
        *(Planned("left out", first + LACKING + i, "novel", (name,), name) for i, name in enumerate(lacking)),
    ]


def power_planned(counts: Counts) -> list[Planned]:
    """The dives of the power curves: every effect alone that remains visible after a refit."""
    names = [name for name in PLANTS if name not in ABSORBED for _ in range(counts.power)]
    first = POWER_BENCH if counts.first == BENCH else counts.first
    return _of_names("power", first + POWER, "one", names)


def _of_names(group: str, first: int, kind: Kind, names: Sequence[str]) -> list[Planned]:
    return [Planned(group, first + i, kind, (name,)) for i, name in enumerate(names)]
