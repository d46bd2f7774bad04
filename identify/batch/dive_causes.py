"""The part of a dive's diagnosis that a batch keeps: its causes with their sizes, as plain data and back.

The sizes of effects that are not named are kept too, as they were fitted together with the causes: otherwise a trend
would begin only when the effect is large enough to be named.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from bridge import plain, schema
from identify.statistics import Z95
from identify.words import MISSING, unit_after, with_interval


@dataclass(frozen=True)
class Size:
    """A parameter of an effect in a dive, SI, with its 95 % interval, None if unknown."""

    value: float
    unit: str
    low95: float | None
    high95: float | None

    @property
    def std(self) -> float:
        """Standard error; NaN without an interval."""
        if self.low95 is None or self.high95 is None:
            return float("nan")
        return (self.high95 - self.low95) / (2 * Z95)

    @property
    def words(self) -> str:
        """`0.83 (0.80 to 0.86)`, with its unit; angles in rad."""
        nan = float("nan")
        ends = (nan if end is None else end for end in (self.low95, self.high95))
        number, interval = with_interval(self.value, *ends)
        return f"{number}{unit_after(self.unit)}{'' if interval == MISSING else f' ({interval})'}"


@dataclass(frozen=True)
class EffectSize:
    """An effect in a dive: its unique `label`, its name in `words`, its parameters in `sizes`.

    `probability`: that it, or an effect in `also`, is present; 0 for no cause. `named`: whether it is more likely
    present than absent.
    """

    label: str
    words: str
    sizes: dict[str, Size]
    probability: float = 0.0
    named: bool = False
    also: tuple[str, ...] = ()

    @property
    def size_words(self) -> str:
        """`gain 0.83 (0.80 to 0.86)`; a cause without a size says so."""
        return ", ".join(f"{name} {size.words}" for name, size in self.sizes.items()) or "no size"


@dataclass(frozen=True)
class DiveCauses:
    """The diagnosis of a dive in short, or the `error` that prevented it.

    `found`: its causes, strongest first, likely or possible; `absent`: sizes of effects that it does not name.
    """

    configuration: str = ""
    verdict: str = ""
    sentence: str = ""
    found: tuple[EffectSize, ...] = ()
    absent: tuple[EffectSize, ...] = ()
    unix_s: float | None = None
    error: str = ""

    def of(self, label: str) -> EffectSize | None:
        """The effect of this label, named or not; None without a size."""
        return next((item for item in (*self.found, *self.absent) if item.label == label), None)

    def to_json(self) -> dict[str, Any]:
        return dict(plain.plain(asdict(self)))

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> "DiveCauses":
        return schema.build(cls, data, "a diagnosis")
