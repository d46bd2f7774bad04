"""The model of a dive flown on another one: what was measured there, and what it foretells without and with the causes.

Every 5 s the simulation is given the measured velocity and then only the recorded thrust and attitude: whoever has
the three velocities can work out the shrink again.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bridge.errors import LogError
from bridge.vehicle.coefficients import DOFS
from identify.diagnose.diagnosis import Prediction
from identify.diagnose.drift import floors_of
from identify.diagnose.flown import coefficients, flown, logarithms, slope_of, spoilt_by
from identify.diagnose.nominal import Nominal, refitted
from identify.diagnose.search import Explanation
from identify.diagnose.shrink import CHANCE, HORIZON_S, LEAST_GAP, Windows, without_seas
from identify.diagnose.whitened import of_the_mean, whitened
from identify.estimators.likelihood_axis import DAMPING, MASS

Array = NDArray[np.float64]

SYMBOLS = "uvwpqr"
UNITS = ("m/s",) * 3 + ("rad/s",) * 3


def windows_of(one: Prediction) -> Windows:
    """The squared drifts at the ends of the windows; each window is a block of its own."""
    ends = np.flatnonzero(np.diff(one.window, append=one.window[-1] + 1))
    before, after = (((way[ends] - one.measured[ends]) / one.floor) ** 2 for way in (one.before, one.after))
    return Windows(before, after, one.window[ends])


def csv_of(one: Prediction) -> str:
    """Header lines that begin with #, then a line an instant."""
    fitted = [dof for dof in range(6) if np.isfinite(one.floor[dof])]
    floors = ", ".join(f"{DOFS[dof]} {one.floor[dof]:.6g} {UNITS[dof]}" for dof in fitted)
    lines = [
        f"# {one.dive}: velocities in body axes (x forward, y right, z down), m/s and rad/s, open loop from the "
        f"measured velocity, started anew every {HORIZON_S:g} s (window).",
        "# measured: smoothed; before: the nominal model; after: with the causes in.",
        f"# floor, rms after {HORIZON_S:g} s by noise alone: {floors}.",
        "# drift: before, or after, less measured in the last line of each window, rms over windows, over the floor, "
        f"and the rms of that over {len(fitted)} degrees of freedom; shrink = (before - after) / (before - floor), "
        f"after no less than floor, and no number where before is no more than {LEAST_GAP:g} over floor: there is too "
        "little to shrink.",
        f"# floor of this dive: the rms over degrees of freedom of 1 where before and after differ by more than "
        f"{LEAST_GAP:g}, and else, for there no cause closes anything and noise is all that there is, of after within "
        f"{1 - CHANCE:g} and {1 + CHANCE:g}.",
    ]
    names = [f"{what}_{SYMBOLS[dof]}" for what in ("measured", "before", "after") for dof in fitted]
    lines.append(",".join(["time_s", "window", *names]))
    values = np.column_stack([way[:, fitted] for way in (one.measured, one.before, one.after)])
    for at_s, window, row in zip(one.time_s, one.window, values, strict=True):
        lines.append(f"{at_s:.3f},{window}," + ",".join(f"{value:.6f}" for value in row))
    return "\n".join(lines) + "\n"


def with_coefficients(model: Nominal, of: Nominal) -> Array:
    """A fit's theta with the masses and dampings of another, and the trims that are best with these."""
    joint, theta = model.joint, model.theta.copy()
    mass, damping = coefficients(of.joint, of.theta)
    for problem, place, at in zip(joint.problems, joint.places, joint.mass_places, strict=True):
        dof = problem.axis.dof
        if damping[dof] > 0:
            theta[[place.start + MASS, at]] = np.log(mass[dof])
            theta[place.start + DAMPING] = np.log(damping[dof])
    rows = whitened(joint, theta, model.doubted)
    kept = sorted({*joint.mass_places, *of_the_mean(joint)})
    trims = [at for at in kept if at not in logarithms(joint)]
    columns = -rows.nominal[:, [kept.index(at) for at in trims]]
    known = joint.prior_precision[trims]
    right = columns.T @ rows.value + known * (joint.prior_mean - theta)[trims]
    theta[trims] += np.linalg.solve(columns.T @ columns + np.diag(known), right)
    return theta


def predict(
    found: Explanation, nominal: Nominal, check: Nominal, name: str, rng: np.random.Generator
) -> Prediction:
    """The model of a dive, `nominal` before and `found` after, on a further dive whose own filters are `check`.

    Masses, dampings and causes are those of the dive; trims and noise levels, that change from dive to dive, the
    further dive's own, and its seas among the noise. Raises LogError where that is too short.
    """
    mass, damping = found.now.course.mass, found.now.course.damping
    course = replace(check.course, mass=mass, damping=damping)
    causes = without_seas(found.causes)
    own = refitted(check, [cause.act(course) for cause in causes])
    nu, wrong = own.motion.nu, spoilt_by(causes, course)
    after = flown(own, with_coefficients(own, found.now), nu, slope=slope_of(causes, course))
    before = flown(check, with_coefficients(check, nominal), nu + wrong)
    floor = floors_of(own, after, rng)[1]
    length = round(HORIZON_S / after.step_s)
    starts = np.arange(0, len(after.time_s) - length - 1, length)
    if len(starts) < 2:
        raise LogError(f"{name}: is too short to check a diagnosis on; give a dive of a minute or more")
    every, still = list(range(1, length + 1)), np.zeros_like(after.nu)
    at = (starts[:, None] + np.arange(1, length + 1)).ravel()
    measured = before.nu[at]
    gone = [np.nan_to_num(model.off(starts, every, still)).reshape(-1, 6) for model in (before, after)]
    return Prediction(
        name,
        after.time_s[at],
        measured,
        measured + gone[0],
        measured + gone[1],
        np.repeat(np.arange(len(starts)), length),
        floor,
    )
