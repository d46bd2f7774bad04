"""What a diagnosis says: verdict, where the gap lies, what causes it, how far it shrinks, what to dive next."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bridge.effects.accepted import AcceptedEffect
from identify.diagnose.candidates import Cause
from identify.diagnose.drift import Drift
from identify.diagnose.unexplained import Parity, Timing, Variable
from identify.identification import Doubt

Array = NDArray[np.float64]

Verdict = Literal["no_gap", "explained", "ambiguous", "unknown"]
Phase = Literal["rest", "accelerating", "decelerating", "steady", "turning", "reversing"]
Fixed = Literal["body", "world", "neither"]


@dataclass(frozen=True)
class Value:
    """A parameter of a cause, SI; NaN ends where the dive gives no interval."""

    value: float
    unit: str
    low95: float
    high95: float


@dataclass(frozen=True)
class Gain:
    """Root mean square velocity error of the feed-forward alone, m/s, without and with what makes up for a cause."""

    before_m_s: float
    after_m_s: float


@dataclass(frozen=True)
class Found:
    """An accepted cause. also: names of causes that this dive can't tell from it, likeness: |cosine| of each;
    probability: that it, or one of `also`, is present; gain_nats: what it saves on held-out pieces beside the
    others."""

    cause: Cause
    also: tuple[str, ...]
    likeness: dict[str, float]
    probability: float
    parameters: dict[str, Value]
    gain_nats: float
    feedforward: Gain | None = None

    @property
    def name(self) -> str:
        return self.cause.effect.name


@dataclass(frozen=True)
class Tried:
    """One candidate of the library: its label and the nats that it saves, or would save, beside the accepted ones in
    whatever form. why: for a crew, why one that would save enough is not accepted."""

    name: str
    label: str
    gain_nats: float
    accepted: bool
    why: str = ""


@dataclass(frozen=True)
class Share:
    """A part of the squared gap; shares sum to 1. dof: surge to yaw."""

    dof: str
    phase: Phase
    share: float


@dataclass(frozen=True)
class Slice:
    """A part of the squared gap by another regime. by: "speed", "heading", "depth", "time", "voltage", "distance";
    low, high: its range, SI."""

    dof: str
    by: str
    low: float
    high: float
    share: float


@dataclass(frozen=True)
class Dependence:
    """What the missing force of a degree of freedom goes with; strength 0 to 1."""

    dof: str
    variable: Variable
    parity: Parity | None
    strength: float


@dataclass(frozen=True)
class Gap:
    """before: rms over axes of the 5 s drift, in floors. drifts: over 1, 5 and 20 s, after: the same once the causes
    are in. force: rms of the missing force by degree of freedom, N and N m. where: shares of the whole gap;
    unexplained: of what no candidate explains, where that is told. drifted: of what the squared 5 s drift is beyond its
    floor."""

    before: float
    drifts: tuple[Drift, ...]
    after: tuple[Drift, ...]
    force: dict[str, float]
    where: tuple[Share, ...]
    slices: tuple[Slice, ...]
    depends_on: tuple[Dependence, ...]
    unexplained: tuple[Share, ...] = ()
    drifted: tuple[Share, ...] = ()


@dataclass(frozen=True)
class Character:
    """Of what no candidate explains."""

    dof: tuple[str, ...]
    frame: Fixed
    parity: Parity
    timing: Timing
    depends_on: tuple[Variable, ...]


@dataclass(frozen=True)
class Prediction:
    """On a further dive, at uniform times (n,): velocities (n, 6) measured (smoothed), and foretold without and with
    the causes, started anew from the measured one with every window. window (n,): which one an instant belongs to;
    the last of a window is its drift. floor (6,): the rms of that by noise alone, NaN in axes that are not fitted."""

    dive: str
    time_s: Array
    measured: Array
    before: Array
    after: Array
    window: NDArray[np.intp]
    floor: Array


@dataclass(frozen=True)
class Shrink:
    """before, after: rms drifts in floors; value = (before - after) / (before - floor), after no less than floor; NaN
    where there is nothing to shrink; low95, high95: of the value, NaN where not known. floor: near 1, as
    `shrink.floor_of` has it."""

    before: float
    after: float
    value: float
    low95: float
    high95: float
    floor: float = 1.0


@dataclass(frozen=True)
class Next:
    """What to dive, or to fit, to split causes that this dive can't tell apart, or to see what none explains."""

    manoeuvre: str
    sensor: str
    splits: tuple[str, ...]


@dataclass(frozen=True)
class Accepted:
    """What accepting the causes comes to. values: by coefficient, those of the linear model and, behind them, of the
    feed-forward's effects, with 95 % intervals. effects: all that were found. sentences: what the feed-forward can't
    make up for, and what else to know. doubts: what the fit beside the causes says against values of the linear model.
    """

    values: dict[str, Value]
    effects: tuple[AcceptedEffect, ...]
    sentences: tuple[str, ...]
    doubts: tuple[Doubt, ...] = ()

    @property
    def tells(self) -> bool:
        """Whether there is anything in it: a log that lacks what the controller used has no size, and tells no mass."""
        return bool(self.values) or any(one.parameters for one in self.effects)


NOTHING = Accepted({}, (), ())


@dataclass(frozen=True)
class Diagnosis:
    """The answer to where, what, and how far. heldout: the prediction for a further dive; check: measured on one;
    None where not asked for. tried: all candidates, strongest first. nats_left: what generic forces foretell beyond.
    numbers: masses and dampings that were fitted beside all that was found, accepted or not. provisos: sentences
    without which the verdict would mislead. first: those before it, that leave nothing of it to rely on."""

    dive: str
    vehicle: str
    configuration: str
    verdict: Verdict
    gap: Gap
    found: tuple[Found, ...]
    tried: tuple[Tried, ...]
    character: Character | None
    heldout: Shrink | None
    check: Shrink | None
    next: Next | None
    notes: tuple[str, ...]
    seconds: float
    prediction: Prediction | None = None
    accepted: Accepted = NOTHING
    numbers: Mapping[str, Value] = field(default_factory=dict)
    provisos: tuple[str, ...] = ()
    first: tuple[str, ...] = ()
