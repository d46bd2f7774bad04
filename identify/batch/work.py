"""Functions that jobs name. Each reads the job's recording and returns plain data for JSON."""

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

    The priors of the vehicle file are left out: shared by all dives, they would pull every dive towards the same
    value and hide changes from dive to dive. Raises LogError, ConfigError or FitError if the dive gives no
    identification.
    """
    dive = read_dive(job.recording.path, job.columns, job.vehicle)
    if dive.sha256 != job.recording.sha256:
        raise LogError(f"{job.recording.path}: changed while the batch ran; run it again when it is whole")
    configuration = job.vehicle.configuration_of(dive.configuration_index())
    named = replace(dive, name=job.recording.name)
    methods = {job.method.rpartition(".")[2]: estimator(job.method)}
    answer = run.identify(named, _without_priors(job.vehicle), configuration, methods).answer
    unix_s, dated_by = date_of(dive)
    return {
        "identification": answer.to_json(),
        "unix_s": unix_s,
        "dated_by": dated_by,
        "voltage_v": _mean_voltage_v(dive),
    }


def _without_priors(file: VehicleFile) -> VehicleFile:
    shapes = {name: replace(shape, priors={}) for name, shape in file.vehicle.configurations.items()}
    return replace(file, vehicle=replace(file.vehicle, configurations=shapes))


def _mean_voltage_v(dive: Dive) -> float | None:
    if dive.voltage is None or not np.isfinite(dive.voltage.value).any():
        return None
    return float(np.nanmean(dive.voltage.value))
