"""A job of a batch: its work, the recording, its key in the cache, and its result.

Jobs and results are sent to other processes, and to other computers.
"""

import hashlib
import json
import os
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bridge.clock import date_in_name
from bridge.errors import ConfigError, FitError, SeatrialError
from bridge.files import check_small
from bridge.vehicle.config import VehicleFile
from identify.batch.code_version import our_version
from identify.ingest.ros.bags import ending_of
from identify.ingest.ros.definitions import files_beside

if TYPE_CHECKING:
    from identify.run.diagnose import Before

IDENTIFY, DIAGNOSE = "identify.batch.dive_jobs:identify", "identify.batch.dive_jobs:diagnose"
"""The functions that jobs name: each takes a Job and returns plain data for JSON, so that no job holds code."""

DEFECTS = (
    ArithmeticError,
    AttributeError,
    ImportError,
    LookupError,
    MemoryError,
    OSError,
    RuntimeError,
    TypeError,
    ValueError,
)
"""Exceptions that a damaged recording may raise in code that did not expect it: the dive fails, the batch goes on."""


@dataclass(frozen=True)
class Recording:
    """A recording on disk; `sha256`, `opening` and `size_bytes` as defined in `ingest.identity`."""

    name: str
    path: Path
    files: tuple[Path, ...]
    sha256: str
    opening: str = ""
    size_bytes: int = 0


@dataclass(frozen=True)
class Result:
    """Result of a job: an `answer` as plain data, or an `error` in a sentence.

    `final` says that the same job would give the same result again, so the cache may keep it.
    """

    key: str
    dive: str
    source: str
    sha256: str
    answer: dict[str, Any] | None = None
    error: str = ""
    final: bool = True

    def to_json(self) -> dict[str, Any]:
        return dict(vars(self))

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> "Result":
        """Rebuild a result. Raises TypeError for data that `to_json` did not make."""
        return cls(**data)


@dataclass(frozen=True)
class Against:
    """The start of a diagnosis.

    accepted: the accepted model of each configuration, None if nothing was accepted. without: effects that the dive's
    own conditions rule out.
    """

    accepted: Mapping[str, "Before"] | None = None
    without: tuple[str, ...] = ()


@dataclass(frozen=True)
class Job:
    """What `function` is to do with a recording, by `method`.

    vehicle: as it was in that dive, with `carried_kg` on top of its file's mass. columns: the file of the column map
    of a table. key: a hash of everything that the answer depends on, from `job_for`.
    """

    function: str
    recording: Recording
    vehicle: VehicleFile
    method: str
    columns: Path | None
    key: str
    against: Against = Against()
    carried_kg: float = 0.0

    def done(self, answer: dict[str, Any]) -> Result:
        recording = self.recording
        return Result(self.key, recording.name, str(recording.path), recording.sha256, answer)

    def failed(self, error: str, final: bool) -> Result:
        recording = self.recording
        return Result(self.key, recording.name, str(recording.path), recording.sha256, None, error, final)


def job_for(
    function: str,
    recording: Recording,
    vehicle: VehicleFile,
    method: str,
    columns: Path | None = None,
    against: Against = Against(),
    carried_kg: float = 0.0,
) -> Job:
    """Make a job; its key changes with anything on which its answer depends.

    Raises OSError if a table can't be read.
    """
    depends_on = {
        "recording": recording.sha256,
        # It dates a dive whose recording has no date.
        "date in its name": date_in_name(recording.name),
        "vehicle": vehicle.sha256,
        "as dived": repr(vehicle.vehicle),
        "against": repr(against),
        "configuration": vehicle.configuration,
        "thrust table": _sha256(thrust_table(vehicle)),
        "columns": _sha256(columns or own_columns(recording)),
        "definitions": [_sha256(file) for file in definitions(recording)],
        "function": function,
        "method": method,
        "version": our_version(),
    }
    key = hashlib.sha256(json.dumps(depends_on, sort_keys=True).encode()).hexdigest()
    return Job(function, recording, vehicle, method, columns, key, against, carried_kg)


def thrust_table(file: VehicleFile) -> Path | None:
    """The thrust table next to a vehicle file; None if the curve is a law or a table of configs/thrusters."""
    curve = file.vehicle.thrust_curve
    table = file.path.parent / curve.file
    return table if curve.kind == "table" and table.is_file() else None


def own_columns(recording: Recording) -> Path | None:
    """The column map inside a dive folder that was made from a table; None if absent."""
    columns = recording.path / "columns.yaml"
    return columns if columns.is_file() else None


def definitions(recording: Recording) -> tuple[Path, ...]:
    bags = [file for file in recording.files if ending_of(file)]
    return tuple(files_beside(bags[0])) if bags else ()


def run_job(job: Job) -> Result:
    """Run a job in this process. An error becomes a result that says so."""
    module, _, name = job.function.partition(":")
    try:
        answer = getattr(import_module(module), name)(job)
        json.dumps(answer, allow_nan=False)  # a number that no file of results can hold costs this dive alone
        return job.done(answer)
    except SeatrialError as error:
        # The name of the dive stands beside the reason.
        reason = error.reason if isinstance(error, FitError) else str(error)
        return job.failed(reason, final=isinstance(error, FitError | ConfigError))
    except DEFECTS as error:
        sentence = (
            f"{type(error).__name__}: {error}; the code did not expect this recording, please report it"
        )
        return job.failed(sentence, final=False)


def _sha256(file: Path | None) -> str:
    if file is None:
        return ""
    check_small(file)
    return hashlib.sha256(file.read_bytes()).hexdigest()


_COUNTS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


def one_thread() -> None:
    """Limit numpy, numba and torch to one thread each in this process, whether they are imported yet or not."""
    for name in _COUNTS:
        os.environ.setdefault(name, "1")
    if (torch := sys.modules.get("torch")) is not None:
        torch.set_num_threads(1)
    if (numba := sys.modules.get("numba")) is None:
        os.environ.setdefault("NUMBA_NUM_THREADS", "1")
    else:
        # A loaded numba reads the variable again when it compiles, and refuses a count other than its first.
        numba.set_num_threads(1)
