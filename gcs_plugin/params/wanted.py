"""What a parameter file asks of a vehicle, and what its sidecar says against it."""

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
    """Parameter id to value; `whole`: it is a model, beside which no effect that was accepted earlier holds; `sidecar`
    says where it comes from, and `system` of which vehicle it was saved, where its form names one."""

    values: dict[str, float]
    notes: tuple[str, ...] = ()
    whole: bool = False
    sidecar: Sidecar | None = None
    system: int | None = None


def wanted_by(path: Path, despite_doubts: bool) -> Wanted:
    """The values of a parameter file. Raises ParamRejected for a damaged one, and for one of an identification that
    did not converge, unless that may pass.
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
