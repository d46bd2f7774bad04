"""A dive whose equations have no solution is refused, by whichever method, in a sentence that names the axes."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from bridge.errors import FitError
from identify.dive import Dive
from identify.estimators.said import axes_named
from identify.identification import Identification

FASTEST = 100.0
"""m/s, and rad/s: no underwater vehicle moves so fast, and what says so drowns all else."""


@contextmanager
def solvable(dive: Dive) -> Iterator[None]:
    """Raises FitError where what is worked out within meets a matrix without an inverse, or ends at no number."""
    try:
        # What overflows is found out by the matrix that it spoils.
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            yield
    except np.linalg.LinAlgError as error:
        raise no_solution(dive) from error


def in_numbers(fit: Identification) -> Identification:
    """The fit itself. Raises LinAlgError where what it says of the coefficients is no number."""
    given = [p for p in fit.parameters if p.identifiable and p.name in fit.covariance_of]
    said = [fit.covariance, np.array([(p.value, p.std, p.low95, p.high95) for p in given])]
    if fit.information is not None:
        said.append(fit.information.matrix)
    if not all(np.isfinite(numbers).all() for numbers in said):
        raise np.linalg.LinAlgError("the fit ended at what is no number")
    return fit


def no_solution(dive: Dive) -> FitError:
    """That a dive's equations have no solution: in which axes, and what to do about it."""
    fastest = _fastest(dive)
    wild = {dof: speed for dof, speed in fastest.items() if speed > FASTEST}
    look = "look there for readings and thrust that are wildly off, and for readings that share one time"
    if wild:
        speed = max(wild.values())
        look = f"readings there reach {speed:.0e} m/s or rad/s, which no vehicle does: leave them out of the recording"
    return FitError(
        f"{dive.name}: the equations of {axes_named(sorted(wild or fastest))} have no solution; {look}, or identify "
        "with another --method"
    )


def _fastest(dive: Dive) -> dict[int, float]:
    """The largest speed that was read, m/s or rad/s, by degree of freedom; without what only read zero."""
    read = [(dive.velocity, 0), (dive.gyro, 3), (dive.fog, 5)]
    found: dict[int, float] = {}
    for signal, first in read:
        if signal is None:
            continue
        for dof, column in enumerate(signal.value.T, first):
            known = column[np.isfinite(column)]
            if known.any():
                found[dof] = max(found.get(dof, 0.0), float(np.abs(known).max()))
    return found
