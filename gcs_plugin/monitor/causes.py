"""Which cause fits a departure best: the drift of the last half minute, on the drift that each cause makes.

The names are those of the library of effects (`identify.effects`), whose forces these are, at unit size; a diagnosis
weighs all of the library, on whole dives. Here each cause is fitted alone, by weighted least squares; its evidence,
in nats, is the misfit that it explains beyond its number of parameters.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np

from bridge.arrays import Array
from gcs_plugin.monitor.losses import MOST_LOST, Loss
from gcs_plugin.monitor.model import Model
from gcs_plugin.monitor.predictor import CORRELATED_S, DRAGGED, Drift, names_of

LEAST_SHARE: Final = 0.1
"""A cause less probable than that is not named."""

LEAST_LOST: Final = 0.03
"""Share of a thruster's thrust: less is nothing."""

OF_AXES: Final = ("forward", "sideways", "vertical", "", "", "turning")


@dataclass(frozen=True)
class Cause:
    """An effect of the library by its label, how probable it is among those that are tried (0 to 1), and in words."""

    label: str
    probability: float
    words: str


def likeliest(
    model: Model, drifts: Sequence[Drift], floors: Array, least_explained: float
) -> tuple[Cause, ...]:
    """The causes of a departure, the likeliest first; none if none explains that share of its mean square. floors (n,
    6)."""
    dofs = list(model.dofs)
    target = np.array([drift.drift[dofs] for drift in drifts]) / floors[:, dofs]
    columns = np.array([drift.causes[:, dofs] for drift in drifts]) / floors[:, None, dofs]
    names = names_of(model)
    whole = float((target**2).sum())
    fits: list[tuple[float, str, str]] = []
    for label, members, words_of in _candidates(model):
        design = np.stack([columns[:, names.index(name)].ravel() for name in members], axis=1)
        size = np.asarray(np.linalg.lstsq(design, target.ravel(), rcond=1e-6)[0], dtype=np.float64)
        words = words_of(size, drifts[-1].place)
        explained = whole - float(((target.ravel() - design @ size) ** 2).sum())
        if not words or explained < least_explained * whole:
            continue
        evidence = 0.5 * explained / CORRELATED_S - 0.5 * len(members) * math.log(len(drifts))
        fits.append((evidence, label, words))
    if not fits:
        return ()
    best = max(fits)[0]
    odds = [math.exp(evidence - best) for evidence, _, _ in fits]
    return _named(
        Cause(label, odd / sum(odds), words) for odd, (_, label, words) in zip(odds, fits, strict=True)
    )


def likeliest_thruster(loss: Loss, *, sized: bool) -> tuple[Cause, ...]:
    """The thrusters that lack thrust, the likeliest first, and how much where the loss is `sized`."""
    odds = np.exp(loss.evidence - loss.evidence.max())
    return _named(
        Cause(f"weak_thruster of thruster {number}", odd, _weak(number, lost) if sized else _weak(number))
        for number, (odd, lost) in enumerate(
            zip((odds / odds.sum()).tolist(), loss.share.tolist(), strict=True), 1
        )
    )


def _named(causes: Iterable[Cause]) -> tuple[Cause, ...]:
    return tuple(sorted((c for c in causes if c.probability >= LEAST_SHARE), key=lambda c: -c.probability))


Words = Callable[[Array, Array], str]
"""A fitted size in words, at a place (2,), north and east; "" for a size that the cause can't have."""


def _candidates(model: Model) -> list[tuple[str, tuple[str, ...], Words]]:
    """Labels, each with its names in `names_of` and its words."""
    count = len(model.configuration.thrusters)
    return [
        *(
            (f"weak_thruster of thruster {n}", (f"thruster {n}",), partial(_weak_words, n))
            for n in range(1, count + 1)
        ),
        ("steady_current", ("water north", "water east"), _current_words),
        ("tether", ("pull north", "pull east", "line"), _tether_words),
        ("net_buoyancy", ("pull down",), _buoyancy_words),
        *(
            (f"fouling of {dof}", (f"drag {dof}",), partial(_fouling_words, dof))
            for dof in DRAGGED
            if dof in model.dofs
        ),
    ]


def _weak_words(number: int, size: Array, _: Array) -> str:
    lost = float(size[0])
    return _weak(number, lost) if LEAST_LOST < lost < MOST_LOST else ""


def _current_words(size: Array, _: Array) -> str:
    return f"a current of {np.hypot(*size):.2f} m/s towards {_heading(size)}"


def _tether_words(size: Array, place: Array) -> str:
    pull = size[:2] - size[2] * place
    return f"a pull of {np.hypot(*pull):.1f} N towards {_heading(pull)}, as of a tether"


def _buoyancy_words(size: Array, _: Array) -> str:
    return f"{abs(size[0]):.1f} N {'heavier' if size[0] > 0 else 'lighter'} than its ballast"


def _fouling_words(dof: int, size: Array, _: Array) -> str:
    return f"more drag {OF_AXES[dof]}: something on the hull" if size[0] > 0 else ""


def _weak(number: int, lost: float | None = None) -> str:
    return (
        f"thruster {number} gives less thrust"
        if lost is None
        else f"thruster {number} gives {100 * lost:.0f} % less"
    )


def _heading(size: Array) -> str:
    return f"{round(math.degrees(math.atan2(size[1], size[0]))) % 360:03d}"
