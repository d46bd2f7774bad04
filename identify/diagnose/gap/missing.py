"""The gap: missing forces and reading errors at every instant, their location, dependence and character."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.thrusters import allocation_matrix
from identify.diagnose.filters.nominal import Nominal, quadratic_of
from identify.diagnose.filters.regression import LEVELLED
from identify.diagnose.gap.drift import Drift
from identify.diagnose.gap.simulation import Simulation
from identify.diagnose.remainder.generic_forces import Parity, Variable, of_other_speeds, unit_forces
from identify.diagnose.remainder.unexplained import Timing, Unexplained
from identify.diagnose.result import Character, Dependence, Disturbance, Fixed, Hull, Phase, Share, Slice
from identify.effects.course import Course, in_a_run
from identify.estimators.likelihood.axis import DISTURBANCE, TIME_CONSTANT
from identify.statistics import left_of
from identify.threads import side_by_side

PHASES: tuple[Phase, ...] = ("rest", "accelerating", "decelerating", "steady", "turning", "reversing")
REST, ACCELERATING, DECELERATING, STEADY, TURNING, REVERSING = range(6)

SLOW, QUICK = 0.15, 0.25
"""Shares of the 95 % quantile of speed, and of acceleration: slower is rest, faster is not steady."""

LEAST_SPEED_M_S, LEAST_TURN_RAD_S = 0.02, 0.03
MEANT_S = 0.5
PUSHED = tuple(dof for dof in range(6) if dof not in LEVELLED)
DRIVEN = 0.25
"""Thrust, relative to that of the hardest driven degree of freedom, from which a degree of freedom counts as driven.

A smaller thrust holds a depth or a heading: it answers the disturbance, and is no larger than that however good the
model.
"""

DROWNED = 0.9
"""Share of the thrusters' variance: where the disturbance takes more in every driven degree of freedom, a dive shows
nothing of thrust, and a cause would describe the sea.
"""

NORMAL = 0.6745
"""Median magnitude of a standard normal variable."""

LEAST_QUIET = 0.01
"""Least median drift, in floors, for an estimate of the usual spread."""

OCTANTS = np.deg2rad(np.arange(-180.0, 181.0, 45.0))
LEAST_SHARE = 0.001

MOST, LEAST_STRENGTH = 3, 0.05

AS_GOOD = 0.97
"""Share of the best force's power from which a plainer force is preferred, in the order of
`generic_forces.unit_forces`."""

WORLD: tuple[Variable, ...] = ("heading", "position")
BODY: tuple[Variable, ...] = ("speed", "yaw_rate", "acceleration", "thrust", "thrust_sign")
TIMINGS: dict[Variable, Timing] = {"time": "drifting", "voltage": "drifting", "acceleration": "transient"}


@dataclass(frozen=True)
class Missing:
    """The missing force and the reading errors at uniform times (n,).

    wrench (n, 6): missing force, N and N m; wrong (n, 6): reading errors; power (n, 6): of both, in units of the
    noise that hides them, which is the disturbance for forces and sensor noise for readings. runs_s: first and last
    time of each run of a dive made of several; empty for a single one.
    """

    time_s: Array
    wrench: Array
    wrong: Array
    power: Array
    runs_s: tuple[tuple[float, float], ...] = ()

    @cached_property
    def recorded(self) -> NDArray[np.bool_]:
        """Whether each instant (n,) lies in a run; all is 0 between two."""
        return in_a_run(self.time_s, self.runs_s)

    def force(self) -> Array:
        """Rms (6,) of the missing force."""
        return np.asarray(np.sqrt(np.mean(self.wrench[self.recorded] ** 2, axis=0)))


def missing_of(before: Simulation, after: Simulation, wrong: Array, felt: Array, noise: Nominal) -> Missing:
    """Difference of two models along one motion.

    wrong (n, 6): velocity errors; felt (n, 3): accelerometer errors, which count as the force of that acceleration.
    Both models lack the same disturbance, so the difference is nearly free of noise.
    """
    wrench = before.lacking - after.lacking
    force, sensor = _levels(noise)
    error = _without_scale(wrong, after.nu)
    power = np.nan_to_num((wrench / force) ** 2) + np.nan_to_num((error / sensor) ** 2)
    power[:, :3] += np.nan_to_num((after.mass[:3] * felt / force[:3]) ** 2)
    missing = Missing(after.time_s, wrench, wrong, power, after.runs_s)
    wrong[~missing.recorded] = power[~missing.recorded] = 0.0
    return missing


def beyond_refit(missing: Missing, wrench: Array, noise: Nominal, every: int) -> Missing:
    """The gap with the power of the causes' forces (n, 6) beyond a refit of masses and drags.

    every: instants of the course per instant of `missing`. The nominal model fits readings, not forces. Precise
    readings, as a gyro's, shift its masses and dampings far, and the missing force then includes that shift.
    """
    force, _ = _levels(noise)
    course, fitted = noise.course, np.isfinite(force)
    known = missing.recorded[:, None]
    nu, nu_dot, force_of_causes = course.nu[::every], course.nu_dot[::every], wrench[::every] * known
    columns = []
    quadratic = quadratic_of(noise.joint, noise.theta)
    for dof, unit in enumerate(np.eye(6)):
        columns += [(unit * nu_dot + course.coriolis_of(unit, nu)) * known, unit * nu * known]
        if quadratic[dof]:
            columns.append(unit * np.abs(nu) * nu * known)
    table = np.stack([(column / force)[:, fitted].ravel() for column in columns], axis=1)
    value = (force_of_causes / force)[:, fitted].ravel()
    sizes, *_ = np.linalg.lstsq(table.T @ table, table.T @ value, rcond=None)
    power = missing.power - np.nan_to_num((missing.wrench / force) ** 2)
    power[:, fitted] += (value - table @ sizes).reshape(len(nu), -1) ** 2
    power[~missing.recorded] = 0.0
    return replace(missing, power=np.maximum(power, 0.0))


def with_unexplained(missing: Missing, left: Unexplained, noise: Nominal, every: int) -> Missing:
    """The gap with the generic forces of the unexplained remainder, beyond a refit of masses, drags and trims.

    every: instants of theirs per instant of `missing`. Power sums over all forces, but in each degree of freedom only
    the strongest counts as a force: their sum is undetermined. Collinear forces may have any size, so none counts for
    more than its nats. A force of k standard deviations saves k^2 / 2 nats per independent disturbance, one every two
    time constants (Bartlett 1946).
    """
    wrench, power, course = missing.wrench.copy(), missing.power.copy(), noise.course
    force, _ = _levels(noise)
    added: set[int] = set()
    seconds, memory_s = float(missing.time_s[-1] - missing.time_s[0]), _time_constants_s(noise)
    quadratic = quadratic_of(noise.joint, noise.theta)
    for shape, size, gain in zip(left.shapes, left.forces, left.gains, strict=True):
        dof = shape.dof
        nu, nu_dot = course.nu[::every, dof], course.nu_dot[::every, dof]
        squared = [np.abs(nu) * nu] if quadratic[dof] else []
        refit = np.column_stack([nu, nu_dot, np.ones(len(nu)), *squared])
        beyond = size * left_of(refit, shape.force[::every])
        beyond = np.where(missing.recorded, beyond, 0.0)
        square = (beyond / force[dof]) ** 2
        most = 2.0 * gain * 2.0 * memory_s[dof] / seconds
        power[:, dof] += square * min(1.0, most / max(float(np.mean(square)), 1e-300))
        if dof not in added:
            wrench[:, dof] += beyond
            added.add(dof)
    return replace(missing, wrench=wrench, power=power)


def _levels(noise: Nominal) -> tuple[Array, Array]:
    """Standard deviations (6,) of the disturbance, N and N m, and of rate readings, m/s and rad/s; infinite for an
    axis that is not fitted."""
    force, sensor = np.full(6, np.inf), np.full(6, np.inf)
    for problem, of_axis in zip(noise.joint.problems, noise.joint.slices, strict=True):
        theta_axis = noise.theta[of_axis]
        force[problem.axis.dof] = np.exp(theta_axis[DISTURBANCE])
        sensor[problem.axis.dof] = np.exp(theta_axis[problem.noise_index])
    return force, sensor


def _time_constants_s(noise: Nominal) -> dict[int, float]:
    """Time constants of the disturbance by degree of freedom, s."""
    return {
        problem.axis.dof: float(np.exp(noise.theta[of_axis][TIME_CONSTANT]))
        for problem, of_axis in zip(noise.joint.problems, noise.joint.slices, strict=True)
    }


def _without_scale(wrong: Array, nu: Array) -> Array:
    """Velocity errors (n, 6) beyond a scale factor."""
    along = np.sum(wrong * nu, axis=0) / np.maximum(np.sum(nu * nu, axis=0), 1e-12)
    return np.asarray(wrong - along * nu)


def phases_of(course: Course, every: int) -> NDArray[np.intp]:
    """Phase (n,) of every n-th instant, an index into PHASES."""
    return phases_of_motion(course.nu[::every], course.step_s * every)


def phases_of_motion(nu: Array, step_s: float) -> NDArray[np.intp]:
    """Index (n,) into PHASES by velocities (n, 6).

    Turning takes precedence over reversing, and reversing over changes of speed.
    """
    kernel = np.ones(max(round(MEANT_S / step_s), 1))
    kernel /= len(kernel)
    speed = np.convolve(np.linalg.norm(nu[:, :3], axis=1), kernel, mode="same")
    gaining = np.gradient(speed, step_s)
    turn = np.abs(np.convolve(nu[:, 5], kernel, mode="same"))
    slow = max(SLOW * float(np.percentile(speed, 95)), LEAST_SPEED_M_S)
    turns = max(SLOW * float(np.percentile(turn, 95)), LEAST_TURN_RAD_S)
    quick = max(QUICK * float(np.percentile(np.abs(gaining), 95)), 1e-6)
    out = np.full(len(nu), STEADY)
    out[gaining > quick] = ACCELERATING
    out[gaining < -quick] = DECELERATING
    out[nu[:, 0] < -slow] = REVERSING
    out[turn > turns] = TURNING
    out[(speed < slow) & (turn <= turns) & (np.abs(gaining) <= quick)] = REST
    return out


def shares_of(power: Array, phases: NDArray[np.intp]) -> tuple[Share, ...]:
    """Shares of a power (n, 6) by degree of freedom and phase, largest first; they sum to 1."""
    table = np.stack([power[phases == k].sum(axis=0) for k in range(len(PHASES))])
    total = float(table.sum())
    if total <= 0:
        return ()
    # Shares below a tenth of a per cent are dropped, the others normalised to 1.
    kept = table > LEAST_SHARE * total
    shares = table * kept / float(table[kept].sum())
    out = [
        Share(DOFS[dof], PHASES[k], float(shares[k, dof])) for k, dof in zip(*np.nonzero(kept), strict=True)
    ]
    return tuple(sorted(out, key=lambda each: -each.share))


def slices_of(power: Array, course: Course, every: int) -> tuple[Slice, ...]:
    """Shares of each degree of freedom's power by speed, heading, depth, time, voltage and distance."""
    total = power.sum(axis=0)
    speed = np.linalg.norm(course.nu[::every, :3], axis=1)
    by = {
        "speed": speed,
        "depth": course.depth_m[::every],
        "time": course.since_s[::every],
        "voltage": course.voltage_v[::every],
        "distance": np.hypot(*course.position_m[::every].T),
    }
    out = []
    for name, values in by.items():
        if np.isfinite(values).all() and np.ptp(values) > 0:
            out += _cut(name, values, np.quantile(values, [0.0, 1 / 3, 2 / 3, 1.0]), power, total)
    heading = np.remainder(course.euler[::every, 2] + np.pi, 2 * np.pi) - np.pi
    return tuple(out + _cut("heading", heading, OCTANTS, power, total))


def _cut(name: str, values: Array, edges: Array, power: Array, total: Array) -> list[Slice]:
    """Slices between the edges (k + 1,)."""
    index = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
    out = []
    for dof in np.flatnonzero(total > LEAST_SHARE * total.sum()).tolist():
        inside = np.bincount(index, power[:, dof], len(edges) - 1) / total[dof]
        out += [
            Slice(DOFS[dof], name, float(low), float(high), float(share))
            for low, high, share in zip(edges[:-1], edges[1:], inside, strict=True)
        ]
    return out


def power_of_generic(left: Unexplained, every: int) -> Array:
    """Squares (n, 6) of the strongest generic forces, each scaled to its nats; (0, 6) without any.

    Not in roll and pitch: insignificant forces there are those of levelling.
    """
    shapes = [
        (generic, gain)
        for generic, gain in zip(left.shapes, left.gains, strict=True)
        if generic.dof in PUSHED
    ]
    out = np.zeros((len(shapes[0][0].force[::every]) if shapes else 0, 6))
    for shape, gain in shapes:
        square = shape.force[::every] ** 2
        out[:, shape.dof] += gain * square / max(float(np.mean(square)), 1e-300)
    return out


def power_of_drift(drift: Drift, time_s: Array, dofs: Sequence[int]) -> Array:
    """Excess (n, 6) of the squared drift around each instant over its floor, in some axes.

    Its sum over the dive is at least 0 in each axis. If no axis exceeds its floor, the result is the whole drift.
    """
    square = np.nan_to_num((drift.off / drift.floor) ** 2)
    square *= np.isin(np.arange(6), list(dofs))
    over = _excess(square)
    return (over if over.any() else square)[_nearest(drift, time_s)]


def power_of_remainder(after: Drift, time_s: Array, dofs: Sequence[int]) -> Array:
    """Excess (n, 6) of the squared drift with the causes in over the dive's usual drift, in some axes.

    A fit takes an unexplained force for noise, and the floor drawn from that noise contains it. An intermittent force
    is absent from most windows, so the median magnitude gives the usual spread (Rousseeuw and Croux 1993, section 1).
    """
    usual = np.median(np.abs(after.off), axis=0) / NORMAL
    quiet = np.clip(usual, LEAST_QUIET * after.floor, after.floor)
    square = np.nan_to_num((after.off / quiet) ** 2) * np.isin(np.arange(6), list(dofs))
    return _excess(square)[_nearest(after, time_s)]


def _excess(square: Array) -> Array:
    """Squares (w, 6), reduced so that their means keep only the excess over 1."""
    mean = np.mean(square, axis=0)
    return np.asarray(square * np.maximum(mean - 1.0, 0.0) / np.maximum(mean, 1e-300))


def _nearest(drift: Drift, time_s: Array) -> NDArray[np.intp]:
    """Window with the middle nearest to each time."""
    middle = drift.starts_s + 0.5 * drift.horizon_s
    return np.clip(np.searchsorted(middle, time_s), 0, len(middle) - 1)


def hull_of(now: Nominal) -> Hull:
    """The fit as a vehicle that can be flown; the time constant is the geometric mean of surge's, sway's and yaw's."""
    force, _ = _levels(now)
    times_s = _time_constants_s(now)
    logs = [math.log(times_s[dof]) for dof in (0, 1, 5) if dof in times_s]
    return Hull(
        tuple(now.course.mass.tolist()),
        tuple(now.course.damping.tolist()),
        tuple(np.where(np.isfinite(force), force, 0.0).tolist()),
        math.exp(sum(logs) / len(logs)) if logs else 1.0,
        tuple(now.course.quadratic.tolist()),
    )


def disturbance_of(now: Nominal) -> tuple[Disturbance, ...]:
    """The fitted stationary disturbance of each degree of freedom, compared with the thrusters' force by the vehicle
    file.

    Without thrust it is compared with the force that the motion takes.
    """
    force, _ = _levels(now)
    course, out = now.course, []
    thrust = {
        axis.dof: float(np.std(axis.force.mean(axis=1)))
        for axis in now.built.axes
        if np.isfinite(force[axis.dof])
    }
    # Effort of each thruster for it, which is comparable between forces and moments.
    reach = np.linalg.norm(allocation_matrix(course.configuration), axis=1)
    work = {dof: std / reach[dof] for dof, std in thrust.items() if dof in PUSHED and reach[dof] > 0}
    hardest = max(work.values(), default=0.0)
    for dof, pushing in thrust.items():
        pushed = dof not in now.built.unpushed and pushing > 0.0
        motion = course.mass * course.nu_dot + course.drag_of(course.nu)
        compared_with = pushing if pushed else float(np.std(motion[:, dof]))
        std = float(force[dof])
        share = min((std / compared_with) ** 2, 1.0) if compared_with > 0 else 1.0
        driven = pushed and work.get(dof, 0.0) > DRIVEN * hardest
        out.append(Disturbance(DOFS[dof], std, share, driven, pushed))
    return tuple(out)


def drowned(disturbance: Sequence[Disturbance]) -> bool:
    """Whether the disturbance hides the thrust in every driven degree of freedom; of none it hides nothing."""
    driven = [each.share for each in disturbance if each.driven]
    return bool(driven) and min(driven) >= DROWNED


def depends_on(missing: Missing, now: Nominal, every: int) -> tuple[Dependence, ...]:
    """Variables that each degree of freedom's missing force depends on, strongest first.

    Strength is the share of its power beyond masses, the hull's drag and a constant that goes with the variable.
    """
    course, quadratic = now.course, quadratic_of(now.joint, now.theta)
    power = missing.power.sum(axis=0)
    if not power.any():
        return ()
    fitted = np.flatnonzero(power > 0.05 * power.sum()).tolist()
    forces = [(v, p, f[::every]) for v, p, f in unit_forces(course, list(range(6)))]

    def of_axis(dof: int) -> list[Dependence]:
        force = missing.wrench[:, dof]
        if not force.any():
            force = missing.wrong[:, dof]
        nu = course.nu[::every, dof]
        squared = [np.abs(nu) * nu] if quadratic[dof] else []
        plain = np.column_stack([np.ones(len(force)), nu, course.nu_dot[::every, dof], *squared])
        others = of_other_speeds(course, [k for k in range(6) if k != dof])
        return _of_axis(dof, force, plain, [*((v, p, f[::every]) for v, p, f in others), *forces])

    out = [each for of_dof in side_by_side(of_axis, fitted) for each in of_dof]
    return tuple(sorted(out, key=lambda each: -each.strength))


def _of_axis(
    dof: int, force: Array, plain: Array, forces: Sequence[tuple[Variable, Parity | None, Array]]
) -> list[Dependence]:
    base, _ = np.linalg.qr(plain)

    def beyond(value: Array) -> Array:
        return np.asarray(value - base @ (base.T @ value))

    left = beyond(force)
    power = float(left @ left)
    columns = np.column_stack([beyond(values) for _, _, values in forces])
    length = np.sqrt(np.sum(columns**2, axis=0))
    nonzero = length > 1e-3 * np.sqrt(len(force))
    columns = columns / np.where(nonzero, length, 1.0)
    out: dict[Variable, Dependence] = {}
    for _ in range(MOST):
        along = np.where(nonzero, columns.T @ left, 0.0)
        best = int(np.argmax(along**2 >= AS_GOOD * np.max(along**2)))
        share = float(along[best] ** 2) / max(power, 1e-300)
        if share < LEAST_STRENGTH:
            break
        variable, parity, _ = forces[best]
        if variable not in out:
            out[variable] = Dependence(DOFS[dof], variable, parity, min(share, 1.0))
        left = left - along[best] * columns[:, best]
    return list(out.values())


def character_of(left: Unexplained) -> Character:
    """Character of the unexplained remainder by its generic forces, each weighted by its nats."""
    weight = dict.fromkeys(DOFS, 0.0)
    frames: dict[Fixed, float] = {"body": 0.0, "world": 0.0, "neither": 0.0}
    parities: dict[Parity, float] = {"odd": 0.0, "even": 0.0, "neither": 0.0}
    timings: dict[Timing, float] = {"steady": 0.0}
    for shape, gain in zip(left.shapes, left.gains, strict=True):
        weight[DOFS[shape.dof]] += gain
        frames["world" if shape.variable in WORLD else "body" if shape.variable in BODY else "neither"] += (
            gain
        )
        parities[shape.parity or "neither"] += gain
        timing = shape.timing or TIMINGS.get(shape.variable, "steady")
        timings[timing] = timings.get(timing, 0.0) + gain
    strongest = max(weight.values(), default=0.0)
    return Character(
        tuple(dof for dof in DOFS if weight[dof] > 0.3 * strongest),
        max(frames, key=lambda name: frames[name]),
        max(parities, key=lambda name: parities[name]),
        max(timings, key=lambda name: timings[name]),
        tuple(dict.fromkeys(shape.variable for shape in left.shapes)),
    )
