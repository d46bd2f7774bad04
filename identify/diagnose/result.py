"""The types of a diagnosis: verdict, gap, causes, shrink, next dive."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.vehicle.coefficients import AcceptedEffect, gain_name
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.gap.drift import Drift
from identify.diagnose.remainder.generic_forces import Parity, Variable
from identify.diagnose.remainder.unexplained import Timing
from identify.diagnose.shrink.shrunk import AxisShrink, Shrink
from identify.doubt import Doubt
from identify.effects.effect import Effect

Verdict = Literal["no_gap", "explained", "partly", "ambiguous", "unknown"]
Phase = Literal["rest", "accelerating", "decelerating", "steady", "turning", "reversing"]
Fixed = Literal["body", "world", "neither"]


@dataclass(frozen=True)
class Value:
    """A parameter of a cause, SI; NaN ends without an interval."""

    value: float
    unit: str
    low95: float
    high95: float


@dataclass(frozen=True)
class Gain:
    """Rms velocity error of the feed-forward alone, m/s, without and with a cause compensated."""

    before_m_s: float
    after_m_s: float


@dataclass(frozen=True)
class Finding:
    """A cause that was found, likely or merely possible.

    also: names of its ambiguity group; likeness: |cosine| of each; probability: that it, or a member of `also`, is
    present; gain_nats: saved on held-out pieces in addition to the other causes. other_thrusters: numbers of those
    that explain the dive equally well.
    """

    cause: Cause
    also: tuple[str, ...]
    likeness: dict[str, float]
    probability: float
    parameters: dict[str, Value]
    gain_nats: float
    feedforward: Gain | None = None
    other_thrusters: tuple[int, ...] = ()

    @property
    def name(self) -> str:
        return self.cause.effect.name

    @property
    def is_ambiguous(self) -> bool:
        """Whether this dive can't tell it from another cause, or its thruster from another."""
        return bool(self.also or self.other_thrusters)


@dataclass(frozen=True)
class Tried:
    """A candidate of the library, and the nats that its best form saves in addition to the accepted causes.

    why: for a crew, why a candidate that saves enough is not accepted. sizes: of a linear candidate that is not
    accepted, the parameters that fit best beside the causes, with intervals by noise alone; without bounds.
    """

    effect: Effect
    gain_nats: float
    accepted: bool
    why: str = ""
    sizes: Mapping[str, Value] = field(default_factory=dict)

    @property
    def name(self) -> str:
        return self.effect.name

    @property
    def label(self) -> str:
        return self.effect.label


@dataclass(frozen=True)
class Share:
    """A part of the squared gap; shares sum to 1. dof: surge to yaw."""

    dof: str
    phase: Phase
    share: float


@dataclass(frozen=True)
class Slice:
    """A part of the squared gap by another variable.

    by: "speed", "heading", "depth", "time", "voltage", "distance"; low, high: its range, SI.
    """

    dof: str
    by: str
    low: float
    high: float
    share: float


@dataclass(frozen=True)
class Dependence:
    """A variable that the missing force of a degree of freedom depends on; strength 0 to 1."""

    dof: str
    variable: Variable
    parity: Parity | None
    strength: float


@dataclass(frozen=True)
class Disturbance:
    """The fitted stationary disturbance in a degree of freedom.

    std: N or N m. share: its variance over that of the thrusters' force, or of the force of the motion if no thruster
    pushes; 1 at most. driven: whether the thrusters push there to move, not merely to hold a depth or a heading.
    """

    dof: str
    std: float
    share: float
    driven: bool
    pushed: bool = True


@dataclass(frozen=True)
class Gap:
    """The gap of a dive.

    before: rms over axes of the 5 s drift, in floors. drifts: over 1, 5 and 20 s; after: the same with the causes in.
    force: rms of the missing force by degree of freedom, N and N m. where: shares of the whole gap.
    unexplained_where: shares of the unexplained remainder, if any. drifted: shares of the squared 5 s drift beyond
    its floor. unexplained: share of the closable gap, held out, that the causes leave; NaN if unknown.
    """

    before: float
    drifts: tuple[Drift, ...]
    after: tuple[Drift, ...]
    force: dict[str, float]
    where: tuple[Share, ...]
    slices: tuple[Slice, ...]
    depends_on: tuple[Dependence, ...]
    unexplained_where: tuple[Share, ...] = ()
    drifted: tuple[Share, ...] = ()
    disturbance: tuple[Disturbance, ...] = ()
    unexplained: float = 0.0


@dataclass(frozen=True)
class Character:
    """Character of the unexplained remainder."""

    dof: tuple[str, ...]
    frame: Fixed
    parity: Parity
    timing: Timing
    depends_on: tuple[Variable, ...]


@dataclass(frozen=True)
class Prediction:
    """Velocities (n, 6) on a further dive, or on held-out pieces, at uniform times (n,), body axes, m/s and rad/s.

    measured: smoothed; before, after, baseline: predicted without and with the causes and by the plain baseline,
    restarted from the measured velocity with every window. window (n,): number of the window; the error at its last
    instant is its drift. floor (6,): rms drift by noise alone, NaN in axes that are not fitted.
    """

    dive: str
    time_s: Array
    measured: Array
    before: Array
    after: Array
    baseline: Array
    window: NDArray[np.intp]
    floor: Array


@dataclass(frozen=True)
class Next:
    """The next dive, or sensor to fit: separates ambiguous causes, or isolates an unexplained remainder."""

    manoeuvres: tuple[str, ...] = ()
    sensors: tuple[str, ...] = ()
    splits: tuple[str, ...] = ()


@dataclass(frozen=True)
class Accepted:
    """The result of accepting the causes.

    values: coefficients of the linear model, then of the feed-forward's effects, with 95 % intervals. effects: all
    causes found. sentences: effects that the feed-forward can't compensate, and other remarks. doubts: of the fit
    with the causes, on values of the linear model.
    """

    values: dict[str, Value]
    effects: tuple[AcceptedEffect, ...]
    sentences: tuple[str, ...]
    doubts: tuple[Doubt, ...] = ()

    @property
    def tells(self) -> bool:
        """Whether it holds anything to accept: a wrong log has no size, and gives no mass."""
        return bool(self.values) or any(effect.parameters for effect in self.effects)

    @property
    def taken_back(self) -> frozenset[str]:
        """Names of the gains that were accepted before and are no longer: those thrusters are not weak any more."""
        return frozenset(set(filter(None, map(_gain_of, self.effects))) - self.values.keys())

    @property
    def in_the_model(self) -> tuple[AcceptedEffect, ...]:
        """The effects without thrusters that are no longer weak; one too weak for the feed-forward is still so."""
        return tuple(each for each in self.effects if not (_gain_of(each) and each.parameters["gain"] == 1.0))


def _gain_of(effect: AcceptedEffect) -> str:
    """The name of a thruster's gain, "" for an effect that is none."""
    return gain_name(effect.number) if effect.number and "gain" in effect.parameters else ""


NOTHING = Accepted({}, (), ())


@dataclass(frozen=True)
class Hull:
    """All masses, linear and quadratic dampings (6 each) of the fit with the causes, SI, 0 for a damping that was not
    fitted; its disturbance's standard deviations (6, N and N m, 0 if not fitted) and time constant."""

    mass: tuple[float, ...]
    damping: tuple[float, ...]
    disturbance: tuple[float, ...]
    disturbance_time_s: float
    quadratic: tuple[float, ...]


@dataclass(frozen=True)
class Diagnosis:
    """The complete answer.

    heldout: cross-validated shrink; check: shrink on a check dive; None if not asked for. tried: all candidates,
    strongest first. prediction: on the check dive; held: on held-out pieces. numbers: masses and dampings fitted
    together with all causes, accepted or not; correlation: of their logarithms, by pairs of names. late: how late the
    thrust acts beyond the vehicle file, s, causes included; None if the dive doesn't tell. provisos: sentences after
    the verdict that limit it. first: sentences before it that invalidate all. hull: the fit with the causes as a
    vehicle that can be flown.
    """

    dive: str
    vehicle: str
    configuration: str
    verdict: Verdict
    gap: Gap
    findings: tuple[Finding, ...]
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
    held: Prediction | None = None
    correlation: Mapping[frozenset[str], float] = field(default_factory=dict)
    late: Value | None = None
    hull: Hull | None = None


def plain(diagnosis: Diagnosis) -> dict[str, Any]:
    """The answer; None for absent parts."""
    character, next_dive = diagnosis.character, diagnosis.next
    return {
        "verdict": diagnosis.verdict,
        "gap": _gap(diagnosis.gap),
        "effects": [plain_effect(finding) for finding in diagnosis.findings],
        "character": None
        if character is None
        else {
            "dof": list(character.dof),
            "frame": character.frame,
            "parity": character.parity,
            "timing": character.timing,
            "depends_on": list(character.depends_on),
        },
        "shrink": {"heldout": _heldout(diagnosis.heldout), "check": _check(diagnosis.check)},
        "next": None
        if next_dive is None
        else {
            "manoeuvre": "; ".join(next_dive.manoeuvres) or None,
            "sensor": "; ".join(next_dive.sensors) or None,
            "splits": list(next_dive.splits),
        },
    }


def _gap(gap: Gap) -> dict[str, Any]:
    return {
        "before": gap.before,
        "floor": 1,
        "force": {dof: _number(force) for dof, force in gap.force.items()},
        "where": [{"dof": part.dof, "phase": part.phase, "share": part.share} for part in gap.where],
        "depends_on": [
            {"dof": part.dof, "variable": part.variable, "parity": part.parity, "strength": part.strength}
            for part in gap.depends_on
        ],
        "unexplained": _number(gap.unexplained),
        "disturbance": {part.dof: _number(part.share) for part in gap.disturbance},
    }


def plain_effect(finding: Finding) -> dict[str, Any]:
    """A cause as an answer has it."""
    gain = finding.feedforward
    return {
        "name": finding.name,
        "also": list(finding.also),
        "likeness": finding.likeness,
        "probability": finding.probability,
        "parameters": {
            name: {
                "value": value.value,
                "unit": value.unit,
                "low95": _number(value.low95),
                "high95": _number(value.high95),
            }
            for name, value in finding.parameters.items()
        },
        **({"other_thrusters": list(finding.other_thrusters)} if finding.other_thrusters else {}),
        **({"since_s": effect.since_s} if (effect := finding.cause.effect).since_s else {}),
        **({"until_s": effect.until_s} if effect.has_ended else {}),
        "feedforward_gain": None if gain is None else {"before": gain.before_m_s, "after": gain.after_m_s},
    }


def _heldout(shrink: Shrink | None) -> dict[str, Any] | None:
    if shrink is None:
        return None
    return {"value": _number(shrink.value), "low95": _number(shrink.low95), "high95": _number(shrink.high95)}


def _check(shrink: Shrink | None) -> dict[str, Any] | None:
    if shrink is None:
        return None
    return {
        "before": _number(shrink.before),
        "after": _number(shrink.after),
        "floor": _number(shrink.floor),
        "value": _number(shrink.value),
        "by_axis": by_axis(shrink.by_axis),
    }


def by_axis(axes: Sequence[AxisShrink]) -> dict[str, dict[str, float | None]]:
    """The shrink of each degree of freedom; drifts in m/s or rad/s."""
    return {axis.dof: _axis(axis) for axis in axes}


def _axis(axis_shrink: AxisShrink) -> dict[str, float | None]:
    return {
        "before": _number(axis_shrink.before),
        "after": _number(axis_shrink.after),
        "floor": _number(axis_shrink.floor),
        "nrmse_before": _number(axis_shrink.nrmse_before),
        "nrmse_after": _number(axis_shrink.nrmse_after),
        "nrmse_baseline": _number(axis_shrink.nrmse_baseline),
    }


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
