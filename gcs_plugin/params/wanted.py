"""The values of a parameter file, with their origin, that a vehicle is to have."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

from bridge.errors import ParamRejected, ParamUnknown
from bridge.vehicle.coefficients import EffectCoefficient
from gcs_plugin.params.files import read_parameters, system_of
from gcs_plugin.params.identified import doubt_lines
from gcs_plugin.params.meaning import coefficient_of
from gcs_plugin.params.sidecar import Interval, Sidecar, read_sidecar

CONVERGED: Final = "converged"


@dataclass(frozen=True)
class Wanted:
    """Values to be sent, by parameter id, with their origin.

    `notes` are sentences about the origin; `whole`: the values are a complete model, so effects accepted earlier no
    longer hold; `sidecar` has intervals and origin, if the file has one; `system` is the MAVLink system that the values
    were saved from, None if the file names none; `left_out` are the lines of the file that were not chosen. If a
    vehicle file was given, `rigid` is mass or inertia of the rigid body and its standard deviation, by the id of the
    total, and `kept` the least and the greatest value that such a vehicle takes, by id, and `gains` its own gain of
    each thruster, by the id of the accepted one.
    """

    values: dict[str, float]
    notes: tuple[str, ...] = ()
    whole: bool = False
    sidecar: Sidecar | None = None
    system: int | None = None
    left_out: frozenset[str] = frozenset()
    rigid: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    kept: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    gains: Mapping[str, float] = field(default_factory=dict)

    @property
    def vehicle(self) -> str:
        """Name of the vehicle that the values are of, "" where the file does not say."""
        return "" if self.sidecar is None else self.sidecar.vehicle

    @property
    def intervals(self) -> Mapping[str, Interval]:
        return {} if self.sidecar is None else self.sidecar.intervals

    @property
    def warnings(self) -> tuple[str, ...]:
        """A line for each value that is doubted."""
        taken = {known.name for name in self.values if (known := coefficient_of(name)) is not None}
        doubted = {} if self.sidecar is None else self.sidecar.doubted
        return tuple(f"warning: {line}" for line in doubt_lines(doubted, taken))

    def narrowed(self, file: Path, only: Collection[str] | None) -> "Wanted":
        """The named lines alone. Raises ParamUnknown for a name that the file lacks.

        Effects that the vehicle holds and a whole model takes back may be named too: only the vehicle knows these.
        """
        missing = [
            name
            for name in only or ()
            if name not in self.values
            and not (self.whole and isinstance(coefficient_of(name), EffectCoefficient))
        ]
        if missing:
            raise ParamUnknown(
                f"{file}: has no {', '.join(missing)}; it has {', '.join(sorted(self.values))}"
            )
        chosen = {name: value for name, value in self.values.items() if only is None or name in only}
        return replace(self, values=chosen, left_out=frozenset(self.values) - frozenset(chosen))


def wanted_by(path: Path, option: str, *, despite_doubts: bool) -> Wanted:
    """Read a parameter file and its sidecar.

    Raises ParamRejected for a damaged file, and for an identification that did not converge unless `despite_doubts`;
    `option` is named as the way to send it all the same.
    """
    if path.suffix == ".json":
        raise ParamRejected(
            f"{path}: is no parameter file; give the .param that `seatrial identify --param` wrote"
        )
    values, sidecar, system = read_parameters(path), read_sidecar(path), system_of(path)
    if sidecar is None:
        return Wanted(values, system=system)
    outcome = sidecar.outcome or CONVERGED
    if outcome != CONVERGED and not despite_doubts:
        raise ParamRejected(
            f"{path}: the identification ended with '{outcome}', so its values may be wrong: nothing was sent; "
            f"dive again, or give {option}"
        )
    origin = (
        f"from {sidecar.dive or 'a dive'} of {sidecar.vehicle or 'a vehicle'}, configuration "
        f"{sidecar.configuration}, by {sidecar.method}: {sidecar.outcome or 'outcome unknown'}"
    )
    return Wanted(values, (origin,), True, sidecar, system)
