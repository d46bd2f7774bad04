"""Conversion of an identification's JSON to the parameters of a vehicle's feed-forward."""

import math
from collections.abc import Collection, Mapping
from typing import Any

from bridge.errors import ParamRejected
from bridge.vehicle.coefficients import DAMPINGS, OF_HULL, QUADRATICS
from gcs_plugin.params import float32


def parameters_from_identification(
    data: Mapping[str, Any], veh_cfg: int, names: Collection[str] | None = None
) -> dict[str, float]:
    """Parameter id to float32 value, for every identifiable coefficient; `names` restricts it to these coefficients.

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
        if coefficient is None or (names is not None and coefficient.name not in names):
            continue
        if estimate.get("identifiable") is not True:
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
        wanted = linear.name in valueless and (names is None or linear.name in names)
        if wanted and squared.parameter_id(veh_cfg) in targets:
            targets[linear.parameter_id(veh_cfg)] = 0.0
    if not targets:
        raise ParamRejected("the identification holds no identifiable coefficient to send; dive again")
    return targets
