"""The sidecar of a `.param`: a JSON file next to it, with the provenance of its values and their intervals."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final

from bridge import schema
from bridge.errors import ConfigError, ParamError, ParamRejected
from bridge.files import read_small, whole
from bridge.plain import from_json, to_json
from bridge.vehicle.coefficients import AcceptedEffect
from bridge.vehicle.forecast import Credit, ForecastRow
from gcs_plugin.params.files import replace_text, unwritten, write_parameters

FORMAT: Final = 1


@dataclass(frozen=True)
class Interval:
    """The coefficient behind a value and its 95 % interval, in `unit`."""

    coefficient: str
    unit: str
    low95: float
    high95: float


@dataclass(frozen=True)
class Sidecar:
    """Provenance of a `.param`.

    - dive_sha256, vehicle_sha256: hashes of dive and vehicle file.
    - configuration, method, version: of the vehicle file, of the identification, and of this program.
    - intervals: the coefficient behind each value, by parameter id.
    - vehicle, dive: names.
    - outcome: that of the identification.
    - format: of the sidecar.
    - thrust_shift: relative change of the thrust by a weighed prior, already contained in the values.
    - dived: beginning of the dive, at least its date.
    - prior_dives: earlier dives that entered the values through priors.
    - dive_opening: hash of the recording's opening, by which a longer recording of the same dive is known.
    - effects: of the model, beyond its coefficients, including those that no parameter holds.
    - doubted: reasons to doubt a value, by coefficient.
    - foretold: tracking error of the next dive with these values.
    - unforetold: sentences on why the next dive, or an axis of it, is not foretold.
    - credits: for each thruster with a gain here, how far the vehicle's allocation already used that gain.
    """

    dive_sha256: str
    vehicle_sha256: str
    configuration: str
    method: str
    version: str
    intervals: dict[str, Interval] = field(default_factory=dict)
    vehicle: str = ""
    dive: str = ""
    outcome: str = ""
    format: int = FORMAT
    thrust_shift: float = 0.0
    dived: str = ""
    prior_dives: tuple[str, ...] = ()
    dive_opening: str = ""
    effects: tuple[AcceptedEffect, ...] = ()
    doubted: dict[str, str] = field(default_factory=dict)
    foretold: tuple[ForecastRow, ...] = ()
    credits: tuple[Credit, ...] = ()
    unforetold: tuple[str, ...] = ()


def sidecar_path(path: Path) -> Path:
    """`hovering.param` -> `hovering.param.json`."""
    return path.with_name(path.name + ".json")


def write_sidecar(path: Path, sidecar: Sidecar) -> Path:
    """Write the sidecar of the parameter file `path` and return the sidecar's path."""
    target = sidecar_path(path)
    replace_text(target, to_json(asdict(sidecar), indent=2) + "\n")
    return target


def write_with_sidecar(
    path: Path,
    values: Mapping[str, float],
    words: Sequence[str],
    sidecar: Sidecar,
    system: int | None = None,
    component: int = 1,
) -> None:
    """Write a parameter file, as `files.write_parameters` does, with its sidecar, or neither: without the sidecar, the
    doubts would be lost. If that fails, both files are as they were."""
    target = sidecar_path(path)
    try:
        before = target.read_bytes() if target.is_file() else None
        write_sidecar(path, sidecar)
        try:
            write_parameters(path, values, words, system, component)
        except ParamError:
            if before is None:
                target.unlink(missing_ok=True)
            else:
                with whole(target) as file:
                    file.write(before)
            raise
    except OSError as error:
        raise unwritten(target, error) from None


def read_sidecar(path: Path) -> Sidecar | None:
    """Read the sidecar of the parameter file `path`; None if it has none. Raises ParamRejected if it is damaged."""
    source = sidecar_path(path)
    if not source.exists():
        return None
    try:
        data: Any = from_json(read_small(source))
        return schema.build(Sidecar, data, str(source))
    except (OSError, ValueError, ConfigError) as error:
        raise ParamRejected(f"{source}: not a sidecar ({error}); remove it or identify again") from None
