"""A sparse-regression discrepancy (Kaheman, Kutz and Brunton 2019; PySINDy's sequentially thresholded least squares).

The force that the nominal model lacks is regressed on generic terms, axis by axis, and the surviving terms are named
by a fixed dictionary. Effects in a sensor's reading, or of one thruster, have no term here: columns for each thruster
leave the others' sizes undetermined. Needs the optional extra `bench`.
"""

import warnings

import numpy as np
import pysindy
from numpy.typing import NDArray

from bench.diagnosis.rivals.said import Said, missing, pushing
from bench.diagnosis.rivals.terms import terms
from identify.diagnose.nominal import Nominal
from identify.effects.course import Course

Array = NDArray[np.float64]

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
