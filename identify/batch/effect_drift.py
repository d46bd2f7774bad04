"""How the sizes of effects drift over the dives of a configuration: a thruster that weakens week by week."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from identify.batch.causes import Causes, Size
from identify.batch.trend import LEVEL, Trend, fit_trend, holm
from identify.ingest.open import utc
from identify.words import capital, decimals_for, fixed, significant, unit_after, with_interval

DAY_S = 86400.0


@dataclass(frozen=True)
class EffectDrift:
    """A parameter of an effect over the dives of one configuration.

    `slope`, `low95` and `high95`: `unit` per `per`; a "dive" where all dives lie within a day. `chance`: probability
    of a slope as large without a drift, corrected for the number of effects that were looked at. `named`: dives that
    name the effect as a cause. `points`: Unix time, size, and whether named, of each dive in the trend.
    """

    label: str
    words: str
    parameter: str
    unit: str
    per: Literal["day", "dive"]
    slope: float
    low95: float
    high95: float
    chance: float
    named: int
    trend: Trend
    points: tuple[tuple[float, Size, bool], ...] = field(repr=False)

    @property
    def is_real(self) -> bool:
        """Whether the drift is significant beside all others that were looked at."""
        return self.chance < LEVEL

    @property
    def sentence(self) -> str:
        """The drift in words, with its slope, interval, ends, and how sure it is."""
        begin, end = self.trend.at(self.trend.first_s), self.trend.at(self.trend.last_s)
        decimals = decimals_for(abs(end - begin) or abs(begin) or 1.0)
        of = unit_after(self.unit)
        slope, interval = with_interval(self.slope, self.low95, self.high95)
        its = f"its {self.parameter}" if self.is_real else f"no drift shows; its {self.parameter}"
        return (
            f"{capital(self.words)}: {its} changes by {slope}{of} per {self.per} (95 %: {interval}), from "
            f"{fixed(begin, decimals)}{of} on {utc(self.trend.first_s)} to {fixed(end, decimals)}{of} on "
            f"{utc(self.trend.last_s)}. {self.named} of {self.trend.count} dives name it. Chance alone gives such a "
            f"slope in {chance_words(self.chance)} of campaigns."
        )


def chance_words(chance: float) -> str:
    """A probability in per cent, never 0: `0.3 %`, `under 0.1 %`."""
    return "under 0.1 %" if chance < 0.001 else f"{significant(100 * chance, 2)} %"


def effect_drifts(dives: Sequence[Causes]) -> tuple[EffectDrift, ...]:
    """The trend of each parameter of each effect that a dated dive names as a cause, surest first.

    `dives`: of one configuration. A dive counts with the size that it found, named or not; one that tells no size of
    an effect is left out of its trend. None for fewer dives than a trend takes.
    """
    dated = [(dive.unix_s, dive) for dive in dives if dive.unix_s is not None]
    looked_at = dict.fromkeys(
        (item.label, name) for _, dive in dated for item in dive.found if item.named for name in item.sizes
    )
    fits = {}
    for label, name in looked_at:
        points = [
            (unix_s, item.sizes[name], item)
            for unix_s, dive in dated
            if (item := dive.of(label)) is not None and name in item.sizes and item.sizes[name].std > 0
        ]
        trend = fit_trend(
            np.array([unix_s for unix_s, _, _ in points]),
            np.array([size.value for _, size, _ in points]),
            np.array([size.std for _, size, _ in points]),
        )
        if trend is not None:
            fits[label, name] = trend, points
    chances = holm({f"{label} {name}": trend.p for (label, name), (trend, _) in fits.items()})
    drifts = []
    for (label, name), (trend, points) in fits.items():
        days = (trend.last_s - trend.first_s) / DAY_S
        by_day = days >= 1.0
        each = days if by_day else trend.count - 1
        drifts.append(
            EffectDrift(
                label,
                points[0][2].words,
                name,
                points[0][1].unit,
                "day" if by_day else "dive",
                trend.change / each,
                trend.low95 / each,
                trend.high95 / each,
                chances[f"{label} {name}"],
                sum(item.named for _, _, item in points),
                trend,
                tuple((unix_s, size, item.named) for unix_s, size, item in points),
            )
        )
    return tuple(sorted(drifts, key=lambda drift: drift.chance))
