"""Candidates ranked by their evidence on held-out pieces, beside the causes of a fit."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from bridge.arrays import Array
from identify.diagnose.causes.candidates import Cause, Setting
from identify.diagnose.causes.evidence import Evidence
from identify.diagnose.causes.weighing import CandidateEquations, Fitted

WEIGHED = 30
"""Best candidates in sample that are weighed on held-out pieces."""

SETTINGS_OF_EACH = 4

LEAST_Z = 1.5


def ranked_candidates(
    candidates: CandidateEquations, fit: Fitted, most: int = WEIGHED
) -> list[tuple[float, float, Cause]]:
    """Gain, gain over its standard error, and cause, for the best setting of each candidate, best first.

    At most `most` settings are weighed, the best in sample, and few of each effect.
    """
    taken = {cause.key for cause in fit.causes}
    best: dict[str, tuple[float, float, Cause]] = {}
    untaken = [
        setting
        for setting in candidates.settings
        if (setting.effect.name, setting.effect.number) not in taken
    ]
    nats = candidates.equations.fitted([setting.columns for setting in untaken])
    weighed = _few_of_each([untaken[i] for i in np.argsort(-nats, kind="stable").tolist()])
    for setting in weighed[:most]:
        evidence, columns = weighed_setting(candidates, setting)
        cause = _cause(setting, columns, evidence.size)
        if not cause.shows:
            continue
        if evidence.gain > best.get(cause.effect.label, (-np.inf,))[0]:
            best[cause.effect.label] = evidence.gain, evidence.gain / max(evidence.std, 1e-12), cause
    return sorted(best.values(), key=lambda each: -each[0])


def _few_of_each(settings: Sequence[Setting]) -> list[Setting]:
    """The first settings of each effect, in order: an effect tried at many sizes leaves room for others."""
    count: Counter[str] = Counter()
    kept = []
    for setting in settings:
        count[setting.effect.label] += 1
        if count[setting.effect.label] <= SETTINGS_OF_EACH:
            kept.append(setting)
    return kept


def weighed_setting(candidates: CandidateEquations, setting: Setting) -> tuple[Evidence, tuple[int, ...]]:
    """Evidence of a setting without its insignificant columns."""
    columns = list(setting.columns)
    evidence = candidates.equations.evidence(columns)
    while len(columns) > 1:
        z = np.abs(evidence.size) / np.sqrt(np.maximum(np.diag(evidence.covariance), 1e-30))
        kept = [column for column, far in zip(columns, z.tolist(), strict=True) if far > LEAST_Z]
        if len(kept) == len(columns):
            break
        columns = kept or [columns[int(np.argmax(z))]]
        evidence = candidates.equations.evidence(columns)
    return evidence, tuple(columns)


def _cause(setting: Setting, columns: Sequence[int], size: Array) -> Cause:
    whole = np.zeros(len(setting.columns))
    whole[[setting.columns.index(column) for column in columns]] = size
    return setting.cause(whole)
