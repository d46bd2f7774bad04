"""What a plain model lacks, instant by instant: the forces that it knows nothing of, and the readings that are off."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.diagnose.flown import Flown
from identify.diagnose.generic import Left
from identify.diagnose.nominal import Nominal
from identify.estimators.likelihood_axis import DISTURBANCE, TIME_CONSTANT

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Missing:
    """At uniform times (n,): wrench (n, 6) N and N m that moves the vehicle and that the model does not know, wrong
    (n, 6) what is read beyond the motion, and both together as power (n, 6), in squares of the noise that hides them:
    a force's in disturbances, a reading's in its sensor's."""

    time_s: Array
    wrench: Array
    wrong: Array
    power: Array

    def force(self) -> Array:
        """(6,) rms."""
        return np.asarray(np.sqrt(np.mean(self.wrench**2, axis=0)))


def missing_of(before: Flown, after: Flown, wrong: Array, felt: Array, noise: Nominal) -> Missing:
    """What two models beside one motion differ by, beside readings of velocities that are `wrong` by (n, 6) and an
    acceleration that is `felt` by (n, 3) too much, which counts as the force that it would take.

    Both lack the same disturbance, so that their difference is all but free of noise.
    """
    wrench = before.lacking - after.lacking
    force, sensor = _levels(noise)
    amiss = _without_scale(wrong, after.nu)
    power = np.nan_to_num((wrench / force) ** 2) + np.nan_to_num((amiss / sensor) ** 2)
    power[:, :3] += np.nan_to_num((after.mass[:3] * felt / force[:3]) ** 2)
    return Missing(after.time_s, wrench, wrong, power)


def beyond_refit(missing: Missing, wrench: Array, noise: Nominal, every: int) -> Missing:
    """The same with, as the power of forces, what the best masses and dampings leave of the causes' own (n, 6), at the
    course's times; every: of its instants, those of `missing`.

    The nominal model fits readings, not forces: where these are fine, as a gyro's, it bends its masses and dampings
    far, and what it lacks then is that, too.
    """
    force, _ = _levels(noise)
    course, fitted = noise.course, np.isfinite(force)
    nu, nu_dot, own = course.nu[::every], course.nu_dot[::every], wrench[::every].copy()
    columns = []
    for unit in np.eye(6):
        columns += [unit * nu_dot + course.coriolis_of(unit, nu), unit * nu]
    table = np.stack([(one / force)[:, fitted].ravel() for one in columns], axis=1)
    value = (own / force)[:, fitted].ravel()
    sizes, *_ = np.linalg.lstsq(table.T @ table, table.T @ value, rcond=None)
    power = missing.power - np.nan_to_num((missing.wrench / force) ** 2)
    power[:, fitted] += (value - table @ sizes).reshape(len(nu), -1) ** 2
    return replace(missing, power=np.maximum(power, 0.0))


def with_left(missing: Missing, left: Left, noise: Nominal, every: int) -> Missing:
    """The same with the generic forces of what no cause explains, less what masses, a damping and a trim of their own
    make of them; every: of their instants, those of `missing`.

    The squares of all count, but of each degree of freedom the strongest alone is told as a force: how they add up is
    not known. None counts for more than the nats that it saves: forces that are all but made of each other have sizes
    that may be anything. A force of k standard deviations saves k^2 / 2 nats of each disturbance that a dive holds,
    and one is another after twice its time constant (Bartlett 1946).
    """
    wrench, power, course = missing.wrench.copy(), missing.power.copy(), noise.course
    force, _ = _levels(noise)
    told: set[int] = set()
    seconds, memory_s = float(missing.time_s[-1] - missing.time_s[0]), _memory_s(noise)
    for shape, size, gain in zip(left.shapes, left.forces, left.gains, strict=True):
        dof = shape.dof
        nu, nu_dot = course.nu[::every, dof], course.nu_dot[::every, dof]
        own = size * _beyond(shape.force[::every], np.column_stack([nu, nu_dot, np.ones(len(nu))]))
        square = (own / force[dof]) ** 2
        most = 2.0 * gain * 2.0 * memory_s[dof] / seconds
        power[:, dof] += square * min(1.0, most / max(float(np.mean(square)), 1e-300))
        if dof not in told:
            wrench[:, dof] += own
            told.add(dof)
    return Missing(missing.time_s, wrench, missing.wrong, power)


def _levels(noise: Nominal) -> tuple[Array, Array]:
    """Standard deviations (6,) of the disturbance, N and N m, and of the readings of rates, m/s and rad/s; infinite
    where an axis is not fitted."""
    force, sensor = np.full(6, np.inf), np.full(6, np.inf)
    for problem, place in zip(noise.joint.problems, noise.joint.places, strict=True):
        own = noise.theta[place]
        force[problem.axis.dof] = np.exp(own[DISTURBANCE])
        sensor[problem.axis.dof] = np.exp(own[problem.noise_place])
    return force, sensor


def _memory_s(noise: Nominal) -> dict[int, float]:
    """Time constants of the disturbance by degree of freedom."""
    return {
        problem.axis.dof: float(np.exp(noise.theta[place][TIME_CONSTANT]))
        for problem, place in zip(noise.joint.problems, noise.joint.places, strict=True)
    }


def _beyond(value: Array, columns: Array) -> Array:
    fitted, *_ = np.linalg.lstsq(columns, value, rcond=None)
    return np.asarray(value - columns @ fitted)


def _without_scale(wrong: Array, nu: Array) -> Array:
    """What a factor on the velocity does not make of it, (n, 6)."""
    along = np.sum(wrong * nu, axis=0) / np.maximum(np.sum(nu * nu, axis=0), 1e-12)
    return np.asarray(wrong - along * nu)
