"""Accepted values of a vehicle as priors, read from the files of `identify` and `diagnose --accept`."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from bridge.exit_codes import UsageError
from bridge.plain import is_number
from bridge.vehicle.coefficients import OF_HULL, AcceptedEffect
from bridge.vehicle.config import Prior
from gcs_plugin.params.identified import sidecar_of
from gcs_plugin.params.sidecar import Sidecar
from identify.doubt import Outcome
from identify.priors import values_sent
from tui.parameter_files import Leave, check_outcome, read_identification, sidecar_of_file

AGEING = {"mass": 0.03, "damping": 0.10, "quadratic": 0.10}
"""Relative standard deviations: water and weed taken along, 1 to 5 kg on 100; fouling and a tether, tens of % over
weeks."""


@dataclass(frozen=True)
class Accepted:
    """The content of an accepted file: the vehicle that it is of ("" if it does not say), how its fit ended, priors,
    reasons to doubt some of them, and effects."""

    vehicle: str
    configuration: str
    outcome: str
    priors: dict[str, Prior]
    doubted: dict[str, str]
    effects: tuple[AcceptedEffect, ...]


def accepted_in(path: Path, widen: float | None, leave: Leave) -> Accepted:
    """Read the JSON of `identify`, or a `.param` with its sidecar.

    The priors assume the thrust of the vehicle file: a correction of thrust by a weighed prior is taken out, because
    the weighed prior stays in the file and would apply it again. `widen` (relative) is added to every width in
    quadrature; None takes AGEING. Raises UsageError for another kind of file, and for an identification that did not
    converge, unless `leave` lets it pass.
    """
    if path.suffix == ".json":
        data = read_identification(path)
        sidecar, values = sidecar_of(data, 0), _identified(data)
    else:
        of_file = sidecar_of_file(path)
        if of_file is None:
            raise UsageError(f"{path}: {_why_no_sidecar(path)}")
        sidecar, values = of_file, _sent(of_file)
    check_outcome(path, sidecar.outcome or Outcome.CONVERGED.value, leave, "written")
    if not values:
        raise UsageError(
            f"{path}: holds no identifiable parameter with an interval given the thrust; identify anew, or dive again"
        )
    dived = f" of {sidecar.dived}" if sidecar.dived else ""
    prior = partial(
        Prior,
        source=f"{sidecar.dive or 'a dive'}{dived}, {sidecar.method or 'identified'}",
        rests_on="thrust",
        dive_sha256=sidecar.dive_sha256,
        earlier_dives=sidecar.prior_dives,
        dive_opening=sidecar.dive_opening,
    )
    priors = {}
    for name, (value, relative_std) in values.items():
        share = AGEING[OF_HULL[name].kind] if widen is None else widen
        priors[name] = prior(value, value * math.hypot(relative_std, share))
    return Accepted(
        sidecar.vehicle, sidecar.configuration, sidecar.outcome, priors, sidecar.doubted, sidecar.effects
    )


def _identified(data: Mapping[str, Any]) -> dict[str, tuple[float, float]]:
    """Value given the thrust, and its relative standard deviation, of each identifiable coefficient."""
    return {
        estimate["name"]: (value, std / value)
        for estimate in data["parameters"]
        if estimate["name"] in OF_HULL
        and estimate.get("identifiable") is True
        and _positive(value := estimate.get("given_thrust"))
        and _positive(std := estimate.get("given_thrust_std"))
    }


def _sent(sidecar: Sidecar) -> dict[str, tuple[float, float]]:
    """As `_identified`, by the intervals of what was sent to a vehicle."""
    intervals = [(each.coefficient, each.low95, each.high95) for each in sidecar.intervals.values()]
    return values_sent(intervals, sidecar.thrust_shift, with_effects=bool(sidecar.effects))


def _why_no_sidecar(path: Path) -> str:
    if not path.exists():
        return "no such file; check the name"
    problem = "is a folder" if path.is_dir() else "has no sidecar that tells its intervals"
    return f"{problem}; give the JSON of `seatrial identify`, or a .param with its sidecar"


def _positive(value: Any) -> bool:
    return is_number(value) and value > 0
