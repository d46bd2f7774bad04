"""A batch's job with one dive: to identify or to diagnose it."""

import math
from dataclasses import replace
from typing import Any

from bridge.errors import FitError, LogError
from bridge.vehicle.config import VehicleFile
from identify.batch.dive_causes import DiveCauses, EffectSize, Size
from identify.batch.jobs import Job
from identify.diagnose.result import Value
from identify.diagnose.shrink.shrunk import LIKELY
from identify.diagnose.words.causes import candidate_words
from identify.diagnose.words.diagnosis import verdict_sentence
from identify.dive import Dive
from identify.estimators.table import estimator
from identify.ingest.open import date_of, read_dive
from identify.run import diagnose as run_diagnose
from identify.run import identify as run_identify
from identify.words import listed


def identify(job: Job) -> dict[str, Any]:
    """Identify the vehicle from this dive alone; also report the dive's date and the battery's mean voltage.

    Raises LogError, ConfigError or FitError if the dive gives no identification.
    """
    dive, file, configuration = read_job(job)
    methods = {job.method.rpartition(".")[2]: estimator(job.method)}
    answer = run_identify.identify(dive, file, configuration, methods).answer
    unix_s, dated_by = date_of(dive)
    voltage = None if dive.voltage is None else dive.voltage.finite()
    return {
        "identification": answer.to_json(),
        "unix_s": unix_s,
        "dated_by": dated_by,
        "voltage_v": float(voltage.value.mean()) if voltage else None,
        "carried_kg": job.carried_kg,
    }


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
    before = run_diagnose.Before() if accepted is None else accepted[configuration]
    diagnosis = run_diagnose.diagnose(
        dive, file, configuration, before=before, without=job.against.without
    ).diagnosis
    causes = tuple(
        EffectSize(
            finding.cause.effect.throughout.label,
            candidate_words(finding.cause.effect.throughout),
            {name: _size(value) for name, value in finding.parameters.items() if name != "thruster"},
            finding.probability,
            finding.probability >= LIKELY,
            (*(f"{finding.name} of thruster {number}" for number in finding.other_thrusters), *finding.also),
        )
        for finding in diagnosis.findings
        if not finding.cause.effect.has_ended
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
    return DiveCauses(configuration, diagnosis.verdict, words, causes, absent, unix_s).to_json()


def read_job(job: Job) -> tuple[Dive, VehicleFile, str]:
    """The job's dive, its vehicle file without priors, and the dive's configuration.

    Shared by all dives, priors would pull every dive towards the same value and hide changes from dive to dive.
    Raises LogError for a recording that changed since the job was made, or can't be read; ConfigError.
    """
    dive = read_dive(job.recording.path, job.columns, job.vehicle)
    if dive.sha256 != job.recording.sha256:
        raise LogError(f"{job.recording.path}: changed while the batch ran; run it again when it is whole")
    configuration = job.vehicle.configuration_of(dive.configuration_index())
    shapes = {name: replace(shape, priors={}) for name, shape in job.vehicle.vehicle.configurations.items()}
    file = replace(job.vehicle, vehicle=replace(job.vehicle.vehicle, configurations=shapes))
    return replace(dive, name=job.recording.name), file, configuration


def _size(value: Value) -> Size:
    low, high = (end if math.isfinite(end) else None for end in (value.low95, value.high95))
    return Size(value.value, value.unit, low, high)
