"""The job that diagnoses a dive of a batch."""

import math
from typing import Any

from bridge.errors import FitError
from identify.batch.causes import Causes, EffectSize, Size
from identify.batch.jobs import Job
from identify.batch.work import read_job
from identify.diagnose.result import Value
from identify.diagnose.shrink.shrunk import LIKELY
from identify.diagnose.words.causes import candidate_words
from identify.diagnose.words.diagnosis import verdict_sentence
from identify.ingest.open import date_of
from identify.run import diagnose as run
from identify.words import listed


def diagnose(job: Job) -> dict[str, Any]:
    """Diagnose this dive alone, without the priors of the vehicle file, and against the accepted model.

    Raises LogError, ConfigError or FitError if the dive can't be diagnosed.
    """
    dive, file, configuration = read_job(job)
    accepted = job.against.accepted
    if accepted is not None and configuration not in accepted:
        raise FitError(
            f"was dived in configuration '{configuration}', and what was accepted is of {listed(sorted(accepted))}; "
            "accept an identification of that one",
            of=job.recording.path,
        )
    before = run.Before() if accepted is None else accepted[configuration]
    diagnosis = run.diagnose(dive, file, configuration, before=before, without=job.against.without).diagnosis
    causes = tuple(
        EffectSize(
            finding.cause.effect.label,
            candidate_words(finding.cause.effect),
            {name: _size(value) for name, value in finding.parameters.items() if name != "thruster"},
            finding.probability,
            finding.probability >= LIKELY,
            finding.also,
        )
        for finding in diagnosis.findings
    )
    absent = tuple(
        EffectSize(
            tried.label,
            candidate_words(tried.effect),
            {name: _size(value) for name, value in tried.sizes.items()},
        )
        for tried in diagnosis.tried
        if tried.sizes and tried.effect.lasting
    )
    unix_s, _ = date_of(dive)
    words = verdict_sentence(diagnosis)
    return Causes(configuration, diagnosis.verdict, words, causes, absent, unix_s).to_json()


def _size(value: Value) -> Size:
    low, high = (end if math.isfinite(end) else None for end in (value.low95, value.high95))
    return Size(value.value, value.unit, low, high)
