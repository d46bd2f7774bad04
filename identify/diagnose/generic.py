"""A broad set of forces of no particular cause: what is left goes with one of them, or it is noise.

Not whiteness: with noise levels learnt from the same dive the innovations are white enough whatever is missing. That
they can be foretold on pieces held out, by anything at all, is what tells of something unexplained.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course
from identify.diagnose.evidence import sums_of
from identify.diagnose.ground import Fitted, Ground
from identify.diagnose.kin import kin
from identify.diagnose.own import Own

Array = NDArray[np.float64]
Variable = Literal[
    "speed", "acceleration", "yaw_rate", "heading", "depth", "altitude", "time", "voltage", "thrust", "thrust_sign",
    "position",
]  # fmt: skip
Parity = Literal["odd", "even", "neither"]

LEAST_STEP = 3.0
"""Nats on held-out pieces below which a further force of an axis is not looked at. It is no threshold of
significance: the best of so many forces saves more than that on a dive that hides nothing."""

MOST = 4

WEIGHED = 12
"""So many that fit best in sample are weighed on pieces held out."""

UNKNOWN_NATS, LEVELLED_NATS = 11.3, 100.0
"""Nats that one force must save, for something unexplained to be there. One that is not there saves x nats on pieces
held out with a chance of exp(-x) at the most (Markov's inequality, for a ratio of likelihoods); some 800 are tried, and
one dive in a hundred may deceive: ln(80000). In roll and pitch far more: a vehicle that is held level tells little of
its own inertia there, and much of what levels it."""

LEAST_FORCE = 0.02
"""Of what the thrusters give in that degree of freedom, both by their spread. A curve from pulses to newtons is not
known better, whatever a long dive with quiet sensors tells of its rest."""


@dataclass(frozen=True)
class Shape:
    """A force (n,) in one degree of freedom: what it goes with, and whether it turns its sign with that."""

    dof: int
    variable: Variable
    parity: Parity | None
    force: Array


@dataclass(frozen=True)
class Left:
    """What is left unexplained: the shapes that foretell it on held-out pieces, strongest first, with the nats (k,)
    that each saves in its axis beside those before it, and the standard deviation (k,) of its force, N or N m.
    explained: nats that the causes save where the vehicle moves."""

    shapes: tuple[Shape, ...] = ()
    gains: tuple[float, ...] = ()
    forces: tuple[float, ...] = ()
    explained: float = 0.0


def left_over(ground: Ground, fit: Fitted) -> Left:
    """What generic forces foretell of a dive's innovations beyond some causes and all that comes along with these.

    Not where the controller used a reading that was not recorded: there thrust answers the sea unseen, and all that
    goes with thrust foretells something.
    """
    course, dofs = ground.now.course, [own.problem.axis.dof for own in ground.rows.own]
    along = [act for cause in fit.causes for act in kin(course, cause)]
    known = np.column_stack([ground.known(fit), ground.rows.columns(along, course)])
    shapes = list(unit_forces(course, dofs))
    forces = np.stack([force for _, _, force in shapes])
    clear = [own for own in ground.rows.own if own.problem.axis.dof not in ground.now.doubted]
    thrust = course.wrench_of(course.thrust_n).std(axis=0)
    found = [one for own in clear for one in _of_axis(ground, fit.value, known, own, forces)]
    found = [one for one in found if one[3] > LEAST_FORCE * thrust[one[0]]]
    found.sort(key=lambda one: -one[2])
    kept = found[:MOST]
    return Left(
        tuple(Shape(dof, *shapes[k]) for dof, k, _, _ in kept),
        tuple(gain for _, _, gain, _ in kept),
        tuple(force for _, _, _, force in kept),
        fit.felt,
    )


def _of_axis(
    ground: Ground, value: Array, known: Array, own: Own, forces: Array
) -> list[tuple[int, int, float, float]]:
    """The places among forces (k, n) of those that foretell one axis, one after another: the axis, the place, the nats
    and the size of each."""
    rows, dof = ground.rows, own.problem.axis.dof
    mine = rows.dof == dof
    columns = own.by_course(ground.now.course, forces)
    nominal = np.column_stack([rows.nominal[mine], known[mine]])
    precision = np.concatenate([rows.nominal_precision, np.zeros(known.shape[1])])
    sums = sums_of(value[mine], nominal, precision, columns, rows.piece[mine])
    kept: list[int] = []
    gains: list[float] = []
    while len(kept) < MOST:
        able = [k for k in range(len(forces)) if k not in kept and sums.telling[k]]
        able.sort(key=lambda k: -sums.fitted([*kept, k]))
        tried = [(sums.evidence([*kept, k]).gain, k) for k in able[:WEIGHED]]
        gain, best = max(tried, default=(-np.inf, -1))
        if gain - sum(gains) < LEAST_STEP:
            break
        kept.append(best)
        gains.append(gain - sum(gains))
    sizes = np.abs(sums.evidence(kept).size) if kept else np.zeros(0)
    return [(dof, k, gain, float(size)) for k, gain, size in zip(kept, gains, sizes, strict=True)]


def unit_forces(course: Course, dofs: list[int]) -> Iterator[tuple[Variable, Parity | None, Array]]:
    """All forces of unit spread, without those that stand still."""
    for variable, parity, force in _forces(course, dofs):
        spread = float(np.std(force)) if np.isfinite(force).all() else 0.0
        if spread > 0:
            yield variable, parity, force / spread


def _forces(course: Course, dofs: list[int]) -> Iterator[tuple[Variable, Parity | None, Array]]:
    nu, since = course.nu, course.since_s / max(float(course.since_s[-1]), 1e-9)
    for dof in dofs:
        speed = nu[:, dof]
        name: Variable = "yaw_rate" if dof == 5 else "speed"
        yield name, "odd", speed * np.abs(speed)
        yield name, "odd", speed**3
        yield name, "even", speed**2
        yield name, "even", np.abs(speed)
        yield name, "odd", np.sign(speed) * np.sqrt(np.abs(speed))
        yield "acceleration", "odd", course.nu_dot[:, dof]
    for i, one in enumerate(dofs):
        for other in dofs[i + 1 :]:
            yield "speed", "even", nu[:, one] * nu[:, other]
            yield "speed", "odd", np.abs(nu[:, one]) * nu[:, other]
            yield "speed", "odd", nu[:, one] * np.abs(nu[:, other])
    wrench = course.wrench_of(course.thrust_n)
    for dof in dofs:
        if np.std(wrench[:, dof]) > 0:
            yield "thrust", "odd", wrench[:, dof]
            yield "thrust", "even", np.abs(wrench[:, dof])
            yield "thrust", "odd", wrench[:, dof] * np.abs(wrench[:, dof])
            yield "thrust_sign", "odd", np.tanh(wrench[:, dof] / (0.1 * np.std(wrench[:, dof])))
            yield "thrust", "odd", wrench[:, dof] * np.abs(nu[:, dof])
    heading = course.euler[:, 2]
    for k in (1, 2):
        yield "heading", None, np.sin(k * heading)
        yield "heading", None, np.cos(k * heading)
    for k in (1, 2, 3):
        yield "time", None, since**k
    for dof in dofs:
        yield "time", None, since * nu[:, dof]
        yield "time", None, since * wrench[:, dof]
    heights: tuple[tuple[Variable, Array], ...] = (("depth", course.depth_m), ("altitude", course.altitude_m))
    for name, values in heights:
        if np.isfinite(values).all():
            yield name, None, values
            yield name, None, values**2
            yield name, None, values * nu[:, 0]
    if np.isfinite(course.voltage_v).all():
        yield "voltage", None, course.voltage_v
        for dof in dofs:
            yield "voltage", None, course.voltage_v * wrench[:, dof]
    north, east = course.position_m.T
    to_north, to_east, _ = course.world
    for axis in range(2):
        yield "position", None, north * to_north[:, axis]
        yield "position", None, east * to_east[:, axis]
        yield "position", None, np.hypot(north, east) * np.sign(nu[:, axis])
