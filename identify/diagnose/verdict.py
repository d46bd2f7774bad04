"""The verdict on a dive, and the next dive, which separates ambiguous causes or isolates an unexplained force."""

import math
from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import DOFS
from identify.diagnose.filters.regression import LEVELLED
from identify.diagnose.remainder.generic_forces import Variable
from identify.diagnose.remainder.unexplained import (
    SELECTED,
    UNKNOWN_NATS,
    GenericForce,
    Unexplained,
    beyond_chance,
)
from identify.diagnose.result import Disturbance, Finding, Next, Verdict
from identify.diagnose.shrink.shrunk import LIKELY, Shrink
from identify.effects.course import Course
from identify.effects.effect import Effect

FORM_SHARE = 0.02
"""Share of the causes' nats that a form's remainder may reach: a form right to a seventh of its force leaves as
much."""

LEAST_CLOSED = 1 / 3
"""Share of the closable gap, held out, that the causes must close for a verdict despite an unexplained remainder."""

WHOLE = 0.95
"""Share of the closable gap, on held-out pieces, from which causes without a remainder count as the true ones."""

MOST_DISTURBED = 1 / 3
"""Share of the thrusters' variance up to which a model need not explain the disturbance."""

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

HUSHED = 0.5
"""Drift, in floors, of a model that foretells roll or pitch far better than the fitted disturbance would let it."""

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


def above_noise(
    left: Unexplained, held: Shrink, inexact: Collection[int], known_to: Array | None = None
) -> Unexplained:
    """The unexplained remainder, without degrees of freedom in which the model drifts no more than noise.

    Degrees of freedom are left out only if the causes close enough of the gap on held-out pieces. If these show no
    gap, they are left out only where even the nominal model is less exact: if any degree of freedom is `inexact`
    (behind an autopilot's filter, or under slowly sampled commands), or if the model holds accepted effects, which
    make up for forces to `known_to` (6,), N and N m. Elsewhere the floor, which comes from the fitted disturbance,
    would have grown by the force itself.

    Slow or rare forces larger than that are kept, because a disturbance absorbs them without a drift, and so are
    reading errors. In roll and pitch nothing is kept with accepted effects, because the estimated angles wander by
    more than such effects (`known_to` is inf for an estimated heading), nor if the model drifts by less than HUSHED of
    the noise. A force that is left out here is not counted in place of the causes either.
    """
    hushed = {
        axis.dof
        for axis in held.by_axis
        if DOFS.index(axis.dof) in LEVELLED and axis.after < HUSHED * axis.floor
    }
    left = _only(left, [k for k, shape in enumerate(left.shapes) if DOFS[shape.dof] not in hushed])
    no_gap = math.isnan(held.value)
    exact = not inexact and known_to is None
    if not (held.value >= LEAST_CLOSED or (no_gap and not exact)):
        return left
    least = np.zeros(6) if known_to is None else np.where(np.isin(range(6), LEVELLED), np.inf, known_to)
    quiet = {axis.dof for axis in held.by_axis if axis.after < (1.0 + QUIET) * axis.floor}
    kept = [
        k
        for k, (shape, force) in enumerate(zip(left.shapes, left.forces, strict=True))
        if DOFS[shape.dof] not in quiet
        or force <= 0
        or (shape.timing not in (None, "transient") and force >= least[shape.dof])
    ]
    dropped = sum(
        gain
        for k, (shape, gain) in enumerate(zip(left.shapes, left.gains, strict=True))
        if k not in kept
        and shape.dof not in inexact
        and shape.timing in SELECTED
        and beyond_chance(shape, gain)
    )
    return replace(_only(left, kept), instead=max(left.instead - dropped, 0.0))


def _only(left: Unexplained, kept: Sequence[int]) -> Unexplained:
    return replace(
        left,
        shapes=tuple(left.shapes[k] for k in kept),
        gains=tuple(left.gains[k] for k in kept),
        forces=tuple(left.forces[k] for k in kept),
    )


def beside_accepted(
    findings: Sequence[Finding], held: Shrink
) -> tuple[tuple[Finding, ...], tuple[Finding, ...]]:
    """Causes found beside accepted effects, and those of them that only show: without any drift beyond noise on
    held-out pieces, they make up for what the accepted values, of another dive, are not known to."""
    return ((), tuple(findings)) if math.isnan(held.value) else (tuple(findings), ())


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


def stand_in(instead_nats: float, saved_nats: float) -> bool:
    """Whether causes only stand in for something that no candidate explains.

    A true cause holds the thrust's delays, several degrees of freedom, or the wrong readings together, in one or two
    numbers. Forces of no particular cause need more of them for less of it, and pay for each on pieces held out. If
    they save more in place of the causes than these do, beyond chance and beyond the remainder of a cause's form, the
    causes are none.
    """
    beyond = instead_nats - saved_nats
    return beyond > UNKNOWN_NATS and beyond > FORM_SHARE * saved_nats


def is_unknown(findings: Sequence[Finding], left: Unexplained, saved_nats: float, closes: float) -> bool:
    """Whether the larger part of a gap is unexplained.

    It is if the causes only stand in for it, unless they close all of it on held-out pieces (`closes`: at most so much,
    NaN if unknown) and nothing is left: forces of no particular cause then save more by the remainder of a form alone.
    Where something is left, it is if the nats left exceed those that the causes save, if no cause is accepted, or if
    the causes certainly close too little of the gap. It also is if they act on the
    motion and certainly close none of it.
    """
    if closes <= 0 and any(cause.cause.effect.acts_on not in ("reading", "log") for cause in findings):
        return True
    left_nats = unexplained_nats(left)
    if stand_in(left.instead, saved_nats):
        return bool(left_nats) or not closes >= WHOLE
    if not left_nats:
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

    saved_nats: by the causes together; closes: share of the gap that they close on held-out pieces at most, NaN if
    unknown; disturbance: of every degree of freedom.
    """
    if is_unknown(findings, left, saved_nats, closes):
        return "unknown"
    if unexplained_forces(left):
        return "partly"
    if not findings:
        return "unknown" if swallowing(disturbance) else "no_gap"
    accepted = [cause for cause in findings if cause.probability >= LIKELY]
    return "ambiguous" if any(cause.also for cause in accepted or findings) else "explained"


def share_left(verdict: Verdict, closes: float) -> float:
    """Share of the closable gap that the causes leave: 0 if everything is explained, NaN if unknown."""
    return 1.0 - float(np.clip(closes, 0.0, 1.0)) if verdict in ("partly", "unknown") else 0.0


def next_of(findings: Sequence[Finding], library: Sequence[Effect]) -> Next | None:
    """Manoeuvres and sensors that separate the ambiguous causes, or the thrusters of one; None without ambiguity."""
    doubtful = [cause for cause in findings if cause.is_ambiguous]
    if not doubtful:
        return None
    by_name = {effect.name: effect for effect in reversed(library)}
    names = [name for cause in doubtful for name in (cause.name, *cause.also)]
    separations = [by_name[name].separation for name in names if name in by_name]
    return Next(
        _each_once(way for separation in separations for way in separation.manoeuvres),
        _each_once(sensor for separation in separations for sensor in separation.sensors),
        _each_once(name for cause in doubtful if cause.also for name in (cause.name, *cause.also)),
    )


def next_for_unexplained(left: Sequence[GenericForce], course: Course, more: Next | None) -> Next:
    """Manoeuvres that isolate the unexplained forces, strongest first, followed by those of `more`."""
    asked = [_manoeuvre(shape, course) for shape in left]
    strongest = _each_once(asked)[:MOST]
    more = more or Next()
    return replace(more, manoeuvres=_each_once((*strongest, *more.manoeuvres)))


def next_for_disturbance(more: Next | None) -> Next:
    """Manoeuvre and readings that separate a sea from a force that the model or the recording lacks, before those of
    `more`."""
    more = more or Next()
    return replace(more, manoeuvres=(SPOT, *more.manoeuvres), sensors=more.sensors or (SEA,))


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
