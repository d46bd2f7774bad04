"""At most one cause, by the Bayesian information criterion (Schwarz 1978) of the whole dive.

Every effect of the library is tried alone, in the product's own regression: its gain in sample, less half the
logarithm of the number of readings for each of its parameters. No piece is held out, and no second cause is sought.
"""

from collections.abc import Sequence

import numpy as np

from bench.diagnosis.rivals.said import Said
from bridge.arrays import Array
from identify.diagnose.candidates import settings_of
from identify.diagnose.nominal import Nominal, refitted
from identify.diagnose.regression import Regression, regression_of
from identify.effects.effect import Effect


def named(nominal: Nominal, library: Sequence[Effect]) -> Said:
    """The effect of least criterion; none if the nominal model alone has the least."""
    rows = regression_of(nominal.joint, nominal.theta, nominal.feedback_unrecorded)
    settings, acts = settings_of(tuple(library), nominal.course)
    square, right = _beside_nominal(rows, rows.columns(acts, nominal.course))
    price = 0.5 * np.log(len(rows.value))
    best, gain = None, 0.0
    for setting in settings:
        if not setting.columns:
            continue
        k = np.array(setting.columns)
        size = _solved(square[np.ix_(k, k)], right[k])
        saved = 0.5 * float(size @ right[k]) - price * len(k)
        if saved > gain:
            best, gain = setting.cause(size), saved
    if best is None:
        return Said((), (), nominal)
    now = refitted(nominal, [best.act(nominal.course)])
    return Said(((best.effect.name, best.effect.number),), (best,), now)


def _beside_nominal(rows: Regression, columns: Array) -> tuple[Array, Array]:
    """Normal equations of the columns with the nominal columns projected out (Frisch and Waugh 1933)."""
    inner = rows.nuisance.square() + np.diag(rows.nominal_precision)
    cross = rows.nuisance.crossed(columns)
    leaning = _solved(inner, np.column_stack([cross, rows.nuisance.crossed(rows.value[:, None])]))
    square = columns.T @ columns - cross.T @ leaning[:, :-1]
    return square, columns.T @ rows.value - cross.T @ leaning[:, -1]


def _solved(square: Array, right: Array) -> Array:
    scale = np.sqrt(np.maximum(np.diag(square), 1e-300))
    inverse = np.linalg.pinv(square / np.outer(scale, scale), rcond=1e-8, hermitian=True)
    return np.asarray(((inverse @ (right.T / scale).T).T / scale).T)
