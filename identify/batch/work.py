"""The job that identifies a dive of a batch, and how a job reads its recording."""

from dataclasses import replace
from typing import Any

import numpy as np

from bridge.errors import LogError
from bridge.vehicle.config import VehicleFile
from identify.batch.jobs import Job
from identify.dive import Dive
from identify.estimators.table import estimator
from identify.ingest.open import date_of, read_dive
from identify.run import identify as run


def identify(job: Job) -> dict[str, Any]:
    """Identify the vehicle from this dive alone; also report the dive's date and the battery's mean voltage.

    Raises LogError, ConfigError or FitError if the dive gives no identification.
    """
    dive, file, configuration = read_job(job)
    methods = {job.method.rpartition(".")[2]: estimator(job.method)}
    answer = run.identify(dive, file, configuration, methods).answer
    unix_s, dated_by = date_of(dive)
    return {
        "identification": answer.to_json(),
        "unix_s": unix_s,
        "dated_by": dated_by,
        "voltage_v": _mean_voltage_v(dive),
        "carried_kg": job.carried_kg,
    }


def read_job(job: Job) -> tuple[Dive, VehicleFile, str]:
    """The job's dive, its vehicle file without priors, and the dive's configuration.

    Shared by all dives, priors would pull every dive towards the same value and hide changes from dive to dive.
    Raises LogError for a recording that changed since the job was made, or can't be read; ConfigError.
    """
    dive = read_dive(job.recording.path, job.columns, job.vehicle)
    if dive.sha256 != job.recording.sha256:
        raise LogError(f"{job.recording.path}: changed while the batch ran; run it again when it is whole")
    configuration = job.vehicle.configuration_of(dive.configuration_index())
    return replace(dive, name=job.recording.name), _without_priors(job.vehicle), configuration


def _without_priors(file: VehicleFile) -> VehicleFile:
    shapes = {name: replace(shape, priors={}) for name, shape in file.vehicle.configurations.items()}
    return replace(file, vehicle=replace(file.vehicle, configurations=shapes))


def _mean_voltage_v(dive: Dive) -> float | None:
    if dive.voltage is None or not np.isfinite(dive.voltage.value).any():
        return None
    return float(np.nanmean(dive.voltage.value))
