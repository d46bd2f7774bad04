"""An identification's JSON as a parameter file with its sidecar: values, intervals, and the doubts about them."""

from collections.abc import Collection, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

from bridge.errors import ParamUnwritten
from bridge.text import as_clause
from bridge.vehicle.coefficients import OF_HULL
from bridge.vehicle.config import VehicleFile
from gcs_plugin.params.files import Sidecar, intervals_of, write_parameters, write_sidecar
from gcs_plugin.params.plan import parameters_from_identification

OF_A_PRIOR: Final = "prior"
"""Culprit of a doubt that concerns no value of the identification."""


def doubted_in(identification: Mapping[str, Any]) -> dict[str, str]:
    """The reasons against each coefficient that is the subject of a doubt in an identification's JSON."""
    reasons: dict[str, dict[str, None]] = {}
    for doubt in identification.get("doubts") or ():
        if doubt.get("culprit") == OF_A_PRIOR:
            continue
        why = as_clause(str(doubt.get("problem") or doubt["sentence"]))
        for name in doubt.get("about") or ():
            reasons.setdefault(str(name), {})[why] = None
    return {name: "; ".join(reasons[name]) for name in OF_HULL if name in reasons}


def doubt_lines(doubted: Mapping[str, str], taken: Collection[str]) -> tuple[str, ...]:
    """A line for each doubted value among those taken."""
    return tuple(f"{name} is doubted: {why}" for name, why in doubted.items() if name in taken)


def write_identified(path: Path, identification: Mapping[str, Any], file: VehicleFile) -> None:
    """Write an identification as a parameter file with its sidecar. Raises ParamRejected."""
    dive, vehicle = identification["dive"], identification["vehicle"]
    configuration, method = identification["configuration"], identification["method"]
    veh_cfg = file.vehicle.veh_cfg(configuration)
    values = parameters_from_identification(identification, veh_cfg)
    ids = {
        str(estimate["name"]): OF_HULL[estimate["name"]].parameter_id(veh_cfg)
        for estimate in identification["parameters"]
        if estimate["identifiable"] and estimate["name"] in OF_HULL
    }
    doubted = {name: why for name, why in doubted_in(identification).items() if name in ids}
    scale = identification["thrust_scale"]
    words = (
        f"{vehicle['name']}, configuration {configuration}, by {method} from {dive['name']}",
        f"outcome: {identification['outcome']}",
        *doubt_lines(doubted, tuple(doubted)),
    )
    write_with_sidecar(
        path,
        values,
        words,
        Sidecar(
            dive["sha256"],
            vehicle["sha256"],
            configuration,
            method,
            version("seatrial"),
            intervals_of(identification, ids),
            vehicle["name"],
            dive["name"],
            identification["outcome"],
            thrust_shift=0.0 if scale is None else scale["shift"],
            dived=dive["date"],
            prior_dives=tuple(identification["prior_dives"]),
            dive_opening=dive["opening"],
            doubted=doubted,
        ),
    )


def write_with_sidecar(
    path: Path, values: Mapping[str, float], words: Sequence[str], sidecar: Sidecar
) -> None:
    """Write a parameter file with its sidecar, or neither: without the sidecar, the doubts would be lost."""
    write_parameters(path, values, words)
    try:
        write_sidecar(path, sidecar)
    except ParamUnwritten:
        path.unlink(missing_ok=True)
        raise
