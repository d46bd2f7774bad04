"""The verdict on a dive, and the next dive: manoeuvres that separate ambiguous causes, or isolate an unexplained
remainder.

Probability of a cause, by the margin of the best explanation without it.

Held-out nats would be log odds for a library that holds the truth and noise like the dive's. Neither is exact, and a
margin is worth less: the curve was calibrated on drawn dives with known causes. `make bench` shows its calibration on
others.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import DOFS
from identify.diagnose.result import Disturbance, Finding, Next, Shrink, Verdict
from identify.diagnose.unexplained import GenericForce, Unexplained, Variable, beyond_chance
from identify.effects.course import Course
from identify.effects.effect import Effect

FORM_SHARE = 0.02
"""Share of the causes' nats that a form's remainder may reach: a form right to a seventh of its force leaves as
much."""

LEAST_CLOSED = 1 / 3
"""Share of the closable gap, held out, that the causes must close for a verdict despite an unexplained remainder."""

MOST_DISTURBED = 1 / 3
"""Share of the thrusters' variance up to which a model need not explain the disturbance."""

Array = NDArray[np.float64]

MOST = 2
"""Number of manoeuvres to ask for: a crew dives one and looks again."""

RUNS = (
    "steady runs ahead and astern at three speeds",
    "steady runs to port and to starboard at three speeds",
    "steady runs up and down at three speeds",
    "rolling to both sides, quickly and slowly",
    "pitching up and down, quickly and slowly",
    "steady turns both ways at three rates",
)
"""Manoeuvres by the degree of freedom of the speed that a force depends on."""

STARTS = (
    "starts and stops ahead and astern, quick and slow",
    "starts and stops to port and to starboard, quick and slow",
    "starts and stops up and down, quick and slow",
    "rolling to both sides, quickly and slowly",
    "pitching up and down, quickly and slowly",
    "turns begun and ended both ways, quickly and slowly",
)

QUIET = 0.25
"""Drift above the floor, in floors, that counts as noise: a force that causes so little was found, but is no gap."""

BATTERY = "the same leg with a fresh and with an empty battery"
THRUSTERS = "one pair of thrusters at a time, from rest"

SPOT = "five minutes on one spot, and five more with the thrusters off"
SEA = "waves, current and tether as the crew sees them, and every thruster's shaft speed"

OTHERS: dict[Variable, str] = {
    "heading": "the same leg on opposite headings",
    "position": "the same leg out and back, near where it began and far from there",
    "depth": "the same run at two depths",
    "altitude": "the same run at two heights above the bottom",
    "time": BATTERY,
    "voltage": BATTERY,
    "thrust": THRUSTERS,
    "thrust_sign": THRUSTERS,
}


def above_noise(left: Unexplained, held: Shrink) -> Unexplained:
    """The unexplained remainder, without degrees of freedom in which the model drifts no more than noise.

    It applies if the causes close enough of the gap on held-out pieces. Slow or rare forces are kept, because a
    disturbance absorbs them without a drift, and so are reading errors.
    """
    if not held.value >= LEAST_CLOSED:
        return left
    quiet = {axis.dof for axis in held.by_axis if axis.after < (1.0 + QUIET) * axis.floor}
    kept = [
        k
        for k, shape in enumerate(left.shapes)
        if DOFS[shape.dof] not in quiet or shape.timing not in (None, "transient") or left.forces[k] <= 0
    ]
    return replace(
        left,
        shapes=tuple(left.shapes[k] for k in kept),
        gains=tuple(left.gains[k] for k in kept),
        forces=tuple(left.forces[k] for k in kept),
    )


def unexplained_forces(left: Unexplained) -> tuple[GenericForce, ...]:
    """The generic forces beyond chance and beyond the causes' form remainder, strongest first."""
    least = FORM_SHARE * left.explained
    return tuple(
        shape
        for shape, gain in zip(left.shapes, left.gains, strict=True)
        if beyond_chance(shape, gain) and gain > least
    )


def unexplained_nats(left: Unexplained) -> float:
    """Nats of the significant generic forces together."""
    significant = {id(shape) for shape in unexplained_forces(left)}
    return sum(gain for shape, gain in zip(left.shapes, left.gains, strict=True) if id(shape) in significant)


def swallowing(disturbance: Sequence[Disturbance]) -> tuple[Disturbance, ...]:
    """Disturbances of driven degrees of freedom that leave a model too little to explain."""
    return tuple(each for each in disturbance if each.driven and each.share > MOST_DISTURBED)


def is_unknown(findings: Sequence[Finding], left_nats: float, saved_nats: float, closes: float) -> bool:
    """Whether the larger part of a gap is unexplained.

    It is if the nats left exceed those that the causes save, if no cause is accepted, or if the causes close too
    little of the gap on held-out pieces (`closes`, NaN if unknown).
    """
    if left_nats <= 0:
        return False
    accepted = any(cause.probability >= LIKELY for cause in findings)
    return not accepted or left_nats > saved_nats or (math.isfinite(closes) and closes < LEAST_CLOSED)


def verdict_of(
    findings: Sequence[Finding],
    left: Unexplained,
    saved_nats: float,
    closes: float,
    disturbance: Sequence[Disturbance],
) -> Verdict:
    """The verdict on a dive. A model that leaves the motion to the disturbance is not without a gap.

    saved_nats: by the causes together; closes: share of the gap that they close on held-out pieces, NaN if unknown;
    disturbance: of every degree of freedom.
    """
    left_nats = unexplained_nats(left)
    if is_unknown(findings, left_nats, saved_nats, closes):
        return "unknown"
    if left_nats > 0:
        return "partly"
    if not findings:
        return "unknown" if swallowing(disturbance) else "no_gap"
    return "ambiguous" if any(cause.also for cause in findings) else "explained"


def share_left(verdict: Verdict, closes: float) -> float:
    """Share of the closable gap that the causes leave: 0 if everything is explained, NaN if unknown."""
    return 1.0 - float(np.clip(closes, 0.0, 1.0)) if verdict in ("partly", "unknown") else 0.0


def next_of(findings: Sequence[Finding], library: Sequence[Effect]) -> Next | None:
    """Manoeuvres and sensors that separate the ambiguous causes; None without ambiguity."""
    doubtful = [cause for cause in findings if cause.also]
    if not doubtful:
        return None
    by_name = {effect.name: effect for effect in reversed(library)}
    names = [name for cause in doubtful for name in (cause.name, *cause.also)]
    separations = [by_name[name].separation for name in names if name in by_name]
    return Next(
        _each_once(way for separation in separations for way in separation.manoeuvres),
        _each_once(sensor for separation in separations for sensor in separation.sensors),
        _each_once(names),
    )


def next_for_unexplained(left: Sequence[GenericForce], course: Course, beside: Next | None) -> Next:
    """Manoeuvres that isolate the unexplained forces, strongest first, followed by those of `beside`."""
    asked = [_manoeuvre(shape, course) for shape in left]
    strongest = _each_once(asked)[:MOST]
    beside = beside or Next()
    return replace(beside, manoeuvres=_each_once((*strongest, *beside.manoeuvres)))


def next_for_disturbance(beside: Next | None) -> Next:
    """Manoeuvre and readings that separate a sea from a force that the model or the recording lacks, before those of
    `beside`."""
    beside = beside or Next()
    return replace(beside, manoeuvres=(SPOT, *beside.manoeuvres), sensors=beside.sensors or (SEA,))


def _each_once(names: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(names))


def _manoeuvre(shape: GenericForce, course: Course) -> str:
    if shape.variable == "acceleration":
        return STARTS[_moved(shape.force, course.nu_dot)]
    if shape.variable in ("speed", "yaw_rate"):
        return RUNS[_moved(shape.force, course.nu)]
    if shape.variable == "time" and shape.timing is not None:
        return SPOT
    return OTHERS[shape.variable]


def _moved(force: Array, motion: Array) -> int:
    """The degree of freedom whose motion (n, 6) has a magnitude most correlated with that of a force (n,)."""
    size = np.abs(np.column_stack([force, motion]))
    size -= size.mean(axis=0)
    along = size[:, 1:].T @ size[:, 0] / np.maximum(np.linalg.norm(size[:, 1:], axis=0), 1e-300)
    return int(np.argmax(along))


MOST_PROBABLE, HALF_NATS = 0.98, 6.0
"""Probability at infinite margin, and the margin for half of it."""

TAKEN_UP = 0.25
"""Share of the nats of unexplained forces that a cause may have taken up by its wrong form."""

LIKELY = 0.5
"""A less probable cause is called possible: neither asserted nor accepted."""


def probability(margin_nats: float, unexplained_nats: float = 0.0) -> float:
    """Probability that a cause, or a member of its ambiguity group, is present, given unexplained forces of so many
    nats.

    The margin counts by its share of the margin and the nats that the cause may have taken up from these forces: next
    to a large unknown force a small margin means little, while a large margin keeps its value.
    """
    margin = min(max(margin_nats, 0.0), 1e6)
    margin *= margin / max(margin + TAKEN_UP * unexplained_nats, 1e-9)
    return MOST_PROBABLE * margin / (margin + HALF_NATS)
