"""Jobs (a function's name, a recording, a vehicle) and their results, both sent to other processes, and the version of
seatrial that made them.

Each process has one thread: with as many processes as cores, a second would have no core.
"""

import hashlib
import json
import os
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bridge.clock import date_in_name
from bridge.errors import ConfigError, FitError, SeatrialError
from bridge.files import check_small
from bridge.vehicle.config import VehicleFile
from bridge.version import installed
from identify.ingest.ros.bags import ending_of
from identify.ingest.ros.definitions import files_beside

if TYPE_CHECKING:
    from identify.run.diagnose import Before

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


PLACE = Path(__file__).resolve().parents[2]
"""Folder that holds the packages, in a checkout or installed."""

ANSWERING = (
    "bench/reproduce/paper.py",
    "bridge/*.py",
    "bridge/firmware/*.py",
    "bridge/vehicle/*.py",
    "bridge/wire/*.py",
    "configs/columns/*.yaml",
    "configs/thrusters/*.csv",
    "identify/*.py",
    "identify/batch/causes.py",
    "identify/batch/jobs.py",
    "identify/batch/work.py",
    "identify/checks/**/*.py",
    "identify/diagnose/**/*.py",
    "identify/effects/*.py",
    "identify/estimators/**/*.py",
    "identify/ingest/**/*.py",
    "identify/run/__init__.py",
    "identify/run/diagnose.py",
    "identify/run/identify.py",
    "identify/thrust/*.py",
)
"""Files that an identification or a diagnosis runs through: if their code changes, the answer may change."""


def our_version() -> str:
    """Text such as `0.1.0, code 3f09c1d2aa`."""
    return f"{installed()}, code {code_stamp(PLACE)}"


def answering(place: Path) -> list[Path]:
    """Files below `place` that match ANSWERING, sorted."""
    return sorted({file for pattern in ANSWERING for file in place.glob(pattern)})


@cache
def code_stamp(place: Path) -> str:
    """Ten hexadecimal digits: a hash of the names and text of these files, computed once per process."""
    digest = hashlib.sha256()
    for file in answering(place):
        text = file.read_text(encoding="utf-8")
        digest.update(f"{file.relative_to(place).as_posix()}\0{text}\0".encode())
    return digest.hexdigest()[:10]


IDENTIFY, DIAGNOSE = "identify.batch.work:identify", "identify.batch.work:diagnose"
"""The kinds of job. A new kind needs another function, `Job -> plain data for JSON`, named the same way."""

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
"""Exceptions that a damaged recording may raise in code that did not expect it. They cost that dive, not the batch."""


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
    """The basis of a diagnosis: by configuration the accepted model, None for none; effects that the dive's own
    conditions rule out."""

    accepted: Mapping[str, "Before"] | None = None
    without: tuple[str, ...] = ()


@dataclass(frozen=True)
class Job:
    """A task for a recording. `vehicle` is as it was in that dive, with `carried_kg` on top of its file's mass;
    `columns` is the file of a table's column map.

    `key` is a hash of everything that the answer depends on: see `job_for`.
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
    """Make a job. Its key hashes recording, date in its name, vehicle, configuration, tables, function, method,
    version, code, and the basis of a diagnosis.

    Raises OSError if a table can't be read.
    """
    on = {
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
    key = hashlib.sha256(json.dumps(on, sort_keys=True).encode()).hexdigest()
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
    """The files beside a bag that define its types."""
    bags = [file for file in recording.files if ending_of(file)]
    return tuple(files_beside(bags[0])) if bags else ()


def run_job(job: Job) -> Result:
    """Run a job in this process. An error becomes its result."""
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
