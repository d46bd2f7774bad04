"""An identification's JSON as parameters: values, intervals, doubts, and the file with its sidecar."""

import math
import re
from collections.abc import Collection, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

from bridge.errors import ParamRejected, ParamUnwritten
from bridge.text import as_clause
from bridge.vehicle.coefficients import DAMPINGS, OF_HULL, QUADRATICS
from bridge.vehicle.config import VehicleFile
from gcs_plugin.params import float32
from gcs_plugin.params.files import LINE_END, Interval, Sidecar, text_in, write_parameters, write_sidecar

OF_A_PRIOR: Final = "prior"
"""Culprit of a doubt that concerns no value of the identification."""


def parameters_from_identification(data: Mapping[str, Any], veh_cfg: int) -> dict[str, float]:
    """Parameter id to float32 value, for every identifiable coefficient.

    If only the quadratic damping of an axis was identified, its linear damping is set to 0, so that no earlier value
    stays in force. Derived values (added mass) and coefficients that are not identifiable are left out. Raises
    ParamRejected for a damaged identification, for a value that is not finite or out of its bounds, and if nothing is
    left to send.
    """
    estimates = data.get("parameters")
    if not isinstance(estimates, list):
        raise ParamRejected("the identification has no list 'parameters'; give the file that --json wrote")
    targets: dict[str, float] = {}
    for estimate in estimates:
        if not isinstance(estimate, dict):
            raise ParamRejected("the identification's list 'parameters' is damaged; identify again")
        coefficient = OF_HULL.get(str(estimate.get("name")))
        if coefficient is None or estimate.get("identifiable") is not True:
            continue
        value = estimate.get("value")
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise ParamRejected(f"{coefficient.name} is {value}, not a finite number; identify again")
        if not coefficient.low <= value <= coefficient.high:
            raise ParamRejected(
                f"{coefficient.name} = {value:g} {coefficient.unit} is outside {coefficient.low:g} to "
                f"{coefficient.high:g}; nothing of this identification is fit to send"
            )
        try:
            targets[coefficient.parameter_id(veh_cfg)] = float32.given(value)
        except ValueError as error:
            raise ParamRejected(f"{coefficient.name}: {error}; identify again") from None
    valueless = {entry["name"] for entry in estimates if entry.get("value") is None}
    for squared in QUADRATICS:
        linear = DAMPINGS[squared.dof]
        if linear.name in valueless and squared.parameter_id(veh_cfg) in targets:
            targets[linear.parameter_id(veh_cfg)] = 0.0
    if not targets:
        raise ParamRejected("the identification holds no identifiable coefficient to send; dive again")
    return targets


def intervals_of(identification: Mapping[str, Any], parameter_ids: Mapping[str, str]) -> dict[str, Interval]:
    """95 % intervals from an identification's JSON, by parameter id; `parameter_ids` maps coefficient name to id."""
    intervals = {}
    for estimate in identification.get("parameters", []):
        name = estimate.get("name")
        if name in parameter_ids and estimate.get("low95") is not None and estimate.get("high95") is not None:
            intervals[parameter_ids[name]] = Interval(
                name, str(estimate.get("unit", "")), float(estimate["low95"]), float(estimate["high95"])
            )
    return intervals


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
    configuration = identification["configuration"]
    veh_cfg = file.vehicle.veh_cfg(configuration)
    values = parameters_from_identification(identification, veh_cfg)
    ids = {
        str(estimate["name"]): OF_HULL[estimate["name"]].parameter_id(veh_cfg)
        for estimate in identification["parameters"]
        if estimate["identifiable"] and estimate["name"] in OF_HULL
    }
    doubted = {name: why for name, why in doubted_in(identification).items() if name in ids}
    sidecar = sidecar_of(identification, ids, doubted)
    words = (
        origin(sidecar.vehicle, configuration, sidecar.method, sidecar.dive),
        f"outcome: {sidecar.outcome}",
        *doubt_lines(doubted, tuple(doubted)),
    )
    write_with_sidecar(path, values, words, sidecar)


def sidecar_of(data: Mapping[str, Any], ids: Mapping[str, str], doubted: Mapping[str, str]) -> Sidecar:
    """Sidecar of an identification's values from its JSON; `ids` are parameter ids by coefficient."""
    dive = data["dive"] if isinstance(data.get("dive"), dict) else {}
    thrust = data.get("thrust_scale") or {}
    return Sidecar(
        str(dive.get("sha256", "")),
        str(data["vehicle"]["sha256"]),
        data["configuration"],
        str(data.get("method", "")),
        version("seatrial"),
        intervals_of(data, ids),
        str(data["vehicle"]["name"]),
        str(dive.get("name", "")),
        data["outcome"],
        thrust_shift=float(thrust.get("shift", 0.0)),
        dived=str(dive.get("date", "")),
        prior_dives=tuple(map(str, data.get("prior_dives", ()))),
        dive_opening=str(dive.get("opening", "")),
        doubted=dict(doubted),
    )


_ORIGIN = re.compile(r"#\s*(.+?), configuration (.+?), by \S+ from .*")


def origin(vehicle: str, configuration: str, method: str, dive: str) -> str:
    """First comment of the files that `identify --param` and `diagnose --accept` write."""
    return f"{vehicle}, configuration {configuration}, by {method} from {dive}"


def origin_in(path: Path) -> tuple[str, str] | None:
    """Vehicle and configuration in a file's `origin`, for a file that lost its sidecar; None without that comment.

    Raises ParamRejected for an unreadable file.
    """
    lines = (_ORIGIN.fullmatch(line) for line in LINE_END.split(text_in(path)))
    return next(((match[1], match[2]) for match in lines if match), None)


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
