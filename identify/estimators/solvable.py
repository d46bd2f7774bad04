"""Refuses a dive whose equations have no solution, with any method, in a sentence that names the axes."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from bridge.errors import FitError
from identify.dive import Dive
from identify.estimators.said import axes_named
from identify.identification import Identification

FASTEST = 100.0
"""m/s, and rad/s: no underwater vehicle moves so fast, and such readings drown all others."""


@contextmanager
def solvable(dive: Dive) -> Iterator[None]:
    """Context that raises FitError if the computation within meets a matrix without an inverse, or ends with a value
    that is not finite."""
    try:
        # An overflow shows up in the matrix that it spoils.
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            yield
    except np.linalg.LinAlgError as error:
        raise no_solution(dive) from error


def in_numbers(fit: Identification) -> Identification:
    """Return the fit itself. Raises LinAlgError if its values for the coefficients are not finite."""
    given = [p for p in fit.parameters if p.identifiable and p.name in fit.covariance_of]
    blocks = [fit.covariance, np.array([(p.value, p.std, p.low95, p.high95) for p in given])]
    if fit.information is not None:
        blocks.append(fit.information.matrix)
    if not all(np.isfinite(numbers).all() for numbers in blocks):
        raise np.linalg.LinAlgError("the fit ended at what is no number")
    return fit


def no_solution(dive: Dive) -> FitError:
    """The error that a dive's equations have no solution: in which axes, and what to do about it."""
    fastest = _fastest(dive)
    wild = {dof: speed for dof, speed in fastest.items() if speed > FASTEST}
    look = (
        "look there for readings and thrust that are wildly off, for readings that share one time, and for a mass or "
        "an inertia in the vehicle file that is not this vehicle's"
    )
    if wild:
        speed = max(wild.values())
        look = f"readings there reach {speed:.0e} m/s or rad/s, which no vehicle does: leave them out of the recording"
    return FitError(
        f"the equations of {axes_named(sorted(wild or fastest))} have no solution; {look}", of=dive.name
    )


def _fastest(dive: Dive) -> dict[int, float]:
    """Largest speed that was read, m/s or rad/s, by degree of freedom; axes that only read zero are left out."""
    read = [(dive.velocity, 0), (dive.gyro, 3), (dive.fog, 5)]
    largest: dict[int, float] = {}
    for signal, first in read:
        if signal is None:
            continue
        for dof, column in enumerate(signal.value.T, first):
            known = column[np.isfinite(column)]
            if known.any():
                largest[dof] = max(largest.get(dof, 0.0), float(np.abs(known).max()))
    return largest
