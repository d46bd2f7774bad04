"""Causes that a dive is sure of: those whose parameters it tells from none, as well as it tells them at all.

The search weighs causes by white innovations, each in a form of its own. What parts of the dive disagree on, and what
other forms, masses and dampings leave open, widens a cause's interval afterwards (`spread`): one that may as well be
absent then is no cause, for a rest of another's form looks so. Not so a sea: its lines beat, so that parts of a dive
disagree on them however high it is; what pieces held out gain by it (`search.LEAST_SEA_GAIN`) tells of it.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from bridge.effects.effect import Effect
from identify.diagnose.ground import Fitted
from identify.diagnose.nominal import Nominal
from identify.diagnose.search import SEAS, Explanation, explained_by
from identify.diagnose.spread import covariance_of

LEAST = 0.95
"""The confidence with which absence lies outside what the dive says of a cause's parameters, all of them together."""


def sure(
    found: Explanation, nominal: Nominal, library: Sequence[Effect]
) -> tuple[Explanation, NDArray[np.float64]]:
    """An explanation without the causes that may as well be absent, the least sure one left out first; and the
    covariance (k, k) of the parameters of those that stay."""
    while found.causes:
        covariance = covariance_of(found.ground, found.fit)
        shares = [
            1.0 if cause.effect.name in SEAS else _confidence(found.fit, covariance, k)
            for k, cause in enumerate(found.causes)
        ]
        k = int(np.argmin(shares))
        if shares[k] > LEAST:
            return found, covariance
        found = explained_by((*found.causes[:k], *found.causes[k + 1 :]), nominal, library)
    return found, np.zeros((0, 0))


def _confidence(fit: Fitted, covariance: NDArray[np.float64], k: int) -> float:
    """With which one cause of a fit is there: Wald's test of all its fitted parameters."""
    cause = fit.causes[k]
    places = [i for i, (of, _) in enumerate(fit.at) if of == k]
    far = np.array(
        [cause.values[p] - cause.effect.parameters[p].none for _, p in (fit.at[i] for i in places)]
    )
    return float(chi2.cdf(far @ np.linalg.pinv(covariance[np.ix_(places, places)]) @ far, len(places)))
