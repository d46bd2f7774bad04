"""A sparse-regression discrepancy (Kaheman, Kutz and Brunton 2019; PySINDy's sequentially thresholded least squares).

The force that the nominal model lacks is regressed on generic terms, axis by axis, and the surviving terms are named
by a fixed dictionary. Effects in a sensor's reading, or of one thruster, have no term here: columns for each thruster
leave the others' sizes undetermined. Needs the optional extra `bench`.
"""

import warnings
from collections.abc import Iterator

import numpy as np
import pysindy

from bench.diagnosis.rivals.said import Said, missing, pushing
from bridge.arrays import Array
from identify.diagnose.nominal import Nominal
from identify.effects.course import Course

SURGE, SWAY, HEAVE, YAW = 0, 1, 2, 5
SOFT_N = 0.2
LONG_S = 300.0

Term = tuple[str, Array]
"""Effect, and force (n,) up to its size."""


def terms(course: Course, dof: int) -> Iterator[Term]:
    """All terms of one degree of freedom."""
    nu, rate = course.nu, course.nu_dot
    thrust = course.wrench_of(course.thrust_n)[:, dof]
    speed, since = nu[:, dof], course.since_s / LONG_S
    yield {SURGE: "thrust_bias", SWAY: "thrust_bias", HEAVE: "net_buoyancy"}.get(dof, ""), np.ones(len(speed))
    yield "", speed
    yield "", rate[:, dof]
    yield "", thrust
    yield "quadratic_drag", speed * np.abs(speed)
    yield "drag_asymmetry", np.abs(speed)
    yield "fouling", since * speed
    yield "battery_sag", since * thrust
    yield "load_sag", thrust * np.abs(course.thrust_n).sum(axis=1)
    yield "thrust_curve", thrust * np.abs(thrust)
    yield "reverse_thrust_loss", np.abs(thrust)
    yield "dead_zone", np.tanh(thrust / SOFT_N)
    yield "inflow_loss", np.abs(thrust) * speed
    yield "thruster_lag", np.gradient(thrust, course.time_s)
    yield from _of_the_water(course, dof)
    yield from _coupled(nu, rate, dof)


def _of_the_water(course: Course, dof: int) -> Iterator[Term]:
    if dof in (SURGE, SWAY):
        north, east = course.in_body(1.0, 0.0)[:, dof], course.in_body(0.0, 1.0)[:, dof]
        yield "steady_current", north
        yield "steady_current", east
        yield "tether", course.position_m[:, 0] * north + course.position_m[:, 1] * east
    if dof in (SWAY, HEAVE) and np.isfinite(course.depth_m).all():
        yield "free_surface", course.nu_dot[:, dof] * np.exp(-course.depth_m)
    if dof in (SWAY, HEAVE) and np.isfinite(course.altitude_m).all():
        yield "bottom_or_wall", course.nu_dot[:, dof] / np.maximum(course.altitude_m, 0.2) ** 3


def _coupled(nu: Array, rate: Array, dof: int) -> Iterator[Term]:
    u, v, w, _, _, r = nu.T
    if dof == SWAY:
        yield "coupled_damping", r
        yield "cross_flow_lift", np.abs(u) * v
        yield "cg_offset", rate[:, YAW]
    if dof == YAW:
        yield "coupled_damping", v
        yield "cross_flow_lift", np.abs(u) * v
        yield "munk_moment", u * v
        yield "cg_offset", rate[:, SWAY]
    if dof == 4:
        yield "munk_moment", u * w
        yield "pitch_roll_coupling", rate[:, SURGE]
    if dof == 3:
        yield "pitch_roll_coupling", rate[:, SWAY]


THRESHOLD = 0.35
"""Least rms force of a surviving term, in standard deviations of the disturbance."""

RIDGE = 0.1
MOST = 2


def named(nominal: Nominal) -> Said:
    """Up to two names, ordered by the force of their strongest terms; the model holds all surviving terms."""
    gap = missing(nominal)
    sizes: dict[int, Array] = {}
    pushes: dict[str, float] = {}
    for dof in gap.dofs:
        table = list(terms(nominal.course, dof))
        columns = np.column_stack([force[gap.at] for _, force in table])
        scale = np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-9)
        coefficients = sparse(columns / scale, gap.wrench[:, dof])
        sizes[dof] = coefficients / scale * gap.std[dof]
        for (name, _), size in zip(table, coefficients.tolist(), strict=True):
            if name and size:
                pushes[name] = max(pushes.get(name, 0.0), abs(size))
    strongest = sorted(pushes, key=lambda name: -pushes[name])

    def wrench(course: Course) -> Array:
        out = np.zeros_like(course.nu)
        for dof, size in sizes.items():
            out[:, dof] = np.column_stack([force for _, force in terms(course, dof)]) @ size
        return out

    return Said(tuple((name, 0) for name in strongest[:MOST]), (pushing("sparse", wrench),), nominal)


def sparse(columns: Array, wanted: Array) -> Array:
    """Sizes (k,) of columns of unit rms, most of them 0."""
    optimizer = pysindy.STLSQ(threshold=THRESHOLD, alpha=RIDGE * len(columns))
    with warnings.catch_warnings():
        # PySINDy warns if no term survives, which is an answer here.
        warnings.simplefilter("ignore", UserWarning)
        optimizer.fit(columns, wanted[:, None])
    sizes: Array = np.asarray(optimizer.coef_, dtype=np.float64)[0]
    return sizes
