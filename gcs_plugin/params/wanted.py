"""Reading a parameter file for an upload: its values, and the warnings from its sidecar."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from bridge.errors import ParamRejected
from gcs_plugin.params.files import read_parameters, system_of
from gcs_plugin.params.plan import coefficient_of
from gcs_plugin.params.sidecar import Sidecar, read_sidecar

CONVERGED: Final = "converged"


@dataclass(frozen=True)
class Wanted:
    """Values of a parameter file, by parameter id.

    `notes` are lines for the operator; `whole`: the file is a complete model, which invalidates effects accepted
    earlier; `sidecar` is its provenance; `system` is the MAVLink system that the file was saved from, None if it names
    none.
    """

    values: dict[str, float]
    notes: tuple[str, ...] = ()
    whole: bool = False
    sidecar: Sidecar | None = None
    system: int | None = None


def wanted_by(path: Path, despite_doubts: bool) -> Wanted:
    """Read a parameter file and its sidecar.

    Raises ParamRejected for a damaged file, and for an identification that did not converge unless `despite_doubts`.
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
            "dive again, or add despite-doubts"
        )
    named = {c.name: name for name in values if (c := coefficient_of(name)) is not None}
    return Wanted(
        values,
        (
            f"from {sidecar.dive or 'a dive'} of {sidecar.vehicle or 'a vehicle'}, configuration "
            f"{sidecar.configuration}, by {sidecar.method}: {outcome}",
            *(f"warning: {named[name]}: {why}" for name, why in sidecar.doubted.items() if name in named),
        ),
        True,
        sidecar,
        system,
    )
