"""A job: a function's name, a recording and a vehicle. A result: what came of it. Both go to other processes."""

import hashlib
import json
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from bridge.errors import ConfigError, FitError, SeatrialError
from bridge.file_size import check_small
from bridge.vehicle.config import CONFIGS, VehicleFile
from identify.batch.version import our_version

IDENTIFY = "identify.batch.work:identify"
"""The one kind of job so far. Another is another function, `Job -> plain data for JSON`, named the same way."""

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
"""What a damaged recording may raise in code that did not expect it; it costs that dive, not the batch."""


@dataclass(frozen=True)
class Recording:
    """One recording as it lies on the disk; `sha256`, `opening` and `size_bytes` as `ingest.identity` has them."""

    name: str
    path: Path
    files: tuple[Path, ...]
    sha256: str
    opening: str = ""
    size_bytes: int = 0


@dataclass(frozen=True)
class Result:
    """What came of one job: an `answer` as plain data, or an `error` in a sentence.

    `final` says that the same job would end the same way again, so that it may be kept.
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
        """Raises TypeError for data that no `to_json` made."""
        return cls(**data)


@dataclass(frozen=True)
class Job:
    """One thing to do with one recording. `columns` is the column map of a table, a file.

    `key` is all that the answer depends on, as one word: see `job_for`.
    """

    function: str
    recording: Recording
    vehicle: VehicleFile
    method: str
    columns: Path | None
    key: str

    def done(self, answer: dict[str, Any]) -> Result:
        found = self.recording
        return Result(self.key, found.name, str(found.path), found.sha256, answer)

    def failed(self, error: str, final: bool) -> Result:
        found = self.recording
        return Result(self.key, found.name, str(found.path), found.sha256, None, error, final)


def job_for(
    function: str, recording: Recording, vehicle: VehicleFile, method: str, columns: Path | None = None
) -> Job:
    """A job, its key made of the bytes of recording, vehicle and tables, of function, method, version and code.

    Raises OSError where a table can't be read.
    """
    on = {
        "recording": recording.sha256,
        "vehicle": vehicle.sha256,
        "configuration": vehicle.configuration,
        "thrust table": _sha256(thrust_table(vehicle)),
        "columns": _sha256(columns or own_columns(recording)),
        "function": function,
        "method": method,
        "version": our_version(),
    }
    key = hashlib.sha256(json.dumps(on, sort_keys=True).encode()).hexdigest()
    return Job(function, recording, vehicle, method, columns, key)


def thrust_table(file: VehicleFile) -> Path | None:
    """The thrust table that lies beside a vehicle file; None where it is one of configs/thrusters, or a law."""
    curve = file.vehicle.thrust_curve
    table = file.path.parent / curve.file
    return table if curve.kind == "table" and table.is_file() else None


def own_columns(recording: Recording) -> Path | None:
    """The column map that a dive folder made from a table holds."""
    columns = recording.path / "columns.yaml"
    return columns if columns.is_file() else None


def column_file(columns: str | None) -> Path | None:
    """The file of a column map, given as a file or as the name of one in configs/columns."""
    if columns is None:
        return None
    bundled = CONFIGS / "columns" / f"{columns}.yaml"
    return bundled if not Path(columns).exists() and bundled.exists() else Path(columns)


def run_job(job: Job) -> Result:
    """Do one job here and now; an error in it becomes its result."""
    module, _, name = job.function.partition(":")
    try:
        function = getattr(import_module(module), name)
        return job.done(function(job))
    except SeatrialError as error:
        return job.failed(str(error), final=isinstance(error, FitError | ConfigError))
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
