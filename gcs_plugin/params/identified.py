"""An identification's JSON as parameters: values, intervals, doubts, and the file with its sidecar."""

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from bridge.errors import ParamRejected
from bridge.plain import is_number
from bridge.text import as_clause
from bridge.vehicle.coefficients import DAMPINGS, OF_HULL, QUADRATICS
from bridge.vehicle.config import VehicleFile
from bridge.version import installed
from gcs_plugin.params import float32
from gcs_plugin.params.files import LINE_END, text_in
from gcs_plugin.params.sidecar import Interval, Sidecar, write_with_sidecar

OF_A_PRIOR: Final = "prior"
"""Culprit of a doubt that concerns no value of the identification."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """A parameter in an identification's JSON, in `unit`, with its 95 % interval; None if undetermined.

    The interval leaves out how well the vehicle file's thrust is known, unless a force standard corrected the thrust:
    values are compared, and act, by that thrust.

    `reason` says why it is not identifiable.
    """

    name: str
    unit: str
    value: float | None
    low95: float | None
    high95: float | None
    identifiable: bool
    reason: str


def estimates_in(identification: Mapping[str, Any]) -> list[Estimate]:
    """The parameters in an identification's JSON.

    Raises ParamRejected for a damaged list, and for a value that is not a finite number.
    """
    entries = identification.get("parameters")
    if not isinstance(entries, list):
        raise ParamRejected("the identification has no list 'parameters'; give the file that --json wrote")
    if not all(isinstance(entry, dict) for entry in entries):
        raise ParamRejected("the identification's list 'parameters' is damaged; identify again")
    thrust = identification.get("thrust_scale") or {}
    at = "" if thrust.get("weighed") else "given_thrust_"
    return [
        Estimate(
            str(entry.get("name")),
            str(entry.get("unit", "")),
            _number(entry, "value"),
            _number(entry, f"{at}low95"),
            _number(entry, f"{at}high95"),
            entry.get("identifiable") is True,
            str(entry.get("reason", "")),
        )
        for entry in entries
    ]


def _number(entry: Mapping[str, Any], key: str) -> float | None:
    number = entry.get(key)
    if number is not None and not is_number(number):
        raise ParamRejected(f"{entry.get('name')} is {number}, not a finite number; identify again")
    return number


def parameters_from_identification(data: Mapping[str, Any], veh_cfg: int) -> dict[str, float]:
    """Parameter id to float32 value, for every identifiable coefficient.

    If only the quadratic damping of an axis was identified, its linear damping is set to 0, so that no earlier value
    stays in force. Derived values (added mass) and coefficients that are not identifiable are left out. Raises
    ParamRejected for a damaged identification, for a value that is not finite or out of its bounds, and if nothing is
    left to send.
    """
    estimates = estimates_in(data)
    targets: dict[str, float] = {}
    for estimate in estimates:
        coefficient = OF_HULL.get(estimate.name)
        if coefficient is None or not estimate.identifiable:
            continue
        value = estimate.value
        if value is None:
            raise ParamRejected(f"{coefficient.name} has no value; identify again")
        if not coefficient.low <= value <= coefficient.high:
            raise ParamRejected(
                f"{coefficient.name} = {value:g} {coefficient.unit} is outside {coefficient.low:g} to "
                f"{coefficient.high:g}; nothing of this identification is fit to send"
            )
        try:
            targets[coefficient.parameter_id(veh_cfg)] = float32.from_user(value)
        except ValueError as error:
            raise ParamRejected(f"{coefficient.name}: {error}; identify again") from None
    valueless = {estimate.name for estimate in estimates if estimate.value is None}
    for squared in QUADRATICS:
        linear = DAMPINGS[squared.dof]
        if linear.name in valueless and squared.parameter_id(veh_cfg) in targets:
            targets[linear.parameter_id(veh_cfg)] = 0.0
    if not targets:
        raise ParamRejected("the identification holds no identifiable coefficient to send; dive again")
    return targets


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
    """A line for each reason to doubt values among those taken, with their names."""
    names: dict[str, list[str]] = {}
    for name, why in doubted.items():
        if name in taken:
            names.setdefault(why, []).append(name)
    return tuple(
        f"{', '.join(of)} {'is' if len(of) == 1 else 'are'} doubted: {why}" for why, of in names.items()
    )


def write_identified(path: Path, identification: Mapping[str, Any], file: VehicleFile) -> None:
    """Write an identification as a parameter file with its sidecar. Raises ParamRejected."""
    veh_cfg = file.vehicle.veh_cfg(identification["configuration"])
    values = parameters_from_identification(identification, veh_cfg)
    sidecar = sidecar_of(identification, veh_cfg)
    words = (
        origin(sidecar.vehicle, sidecar.configuration, sidecar.method, sidecar.dive),
        f"outcome: {sidecar.outcome}",
        *doubt_lines(sidecar.doubted, tuple(sidecar.doubted)),
    )
    write_with_sidecar(path, values, words, sidecar)


def sidecar_of(data: Mapping[str, Any], veh_cfg: int) -> Sidecar:
    """Sidecar of an identification's values, from its JSON. Raises ParamRejected for a damaged identification."""
    dive = data["dive"] if isinstance(data.get("dive"), dict) else {}
    thrust = data.get("thrust_scale") or {}
    sent = {
        estimate.name: estimate
        for estimate in estimates_in(data)
        if estimate.identifiable and estimate.name in OF_HULL
    }
    return Sidecar(
        str(dive.get("sha256", "")),
        str(data["vehicle"]["sha256"]),
        data["configuration"],
        str(data.get("method", "")),
        installed(),
        {
            OF_HULL[name].parameter_id(veh_cfg): Interval(
                name, estimate.unit, estimate.low95, estimate.high95
            )
            for name, estimate in sent.items()
            if estimate.low95 is not None and estimate.high95 is not None
        },
        str(data["vehicle"]["name"]),
        str(dive.get("name", "")),
        data["outcome"],
        thrust_shift=float(thrust.get("shift", 0.0)),
        dived=str(dive.get("date", "")),
        prior_dives=tuple(map(str, data.get("prior_dives", ()))),
        dive_opening=str(dive.get("opening", "")),
        doubted={name: why for name, why in doubted_in(data).items() if name in sent},
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
