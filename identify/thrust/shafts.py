"""The wrench of thrusters whose shaft speed lags; thrust is proportional to the square of that speed."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.thrusters import allocation_matrix
from identify.dive import Dive, Signal
from identify.ingest.commands import unknown_between
from identify.thrust.wrench import asked_thrusts, tells_thrusters
from identify.thrust.wrench_history import WrenchHistory, history_of, lagged_states

STEPS_A_LAG = 8.0
"""Steps within a lag over which a thrust counts as steady: that misses a thousandth of its change."""


def wrench_by_shafts(
    dive: Dive, file: VehicleFile, configuration_name: str, by_thrust: WrenchHistory
) -> WrenchHistory | None:
    """Return the wrench of a dive with the vehicle file's lag as that of the shafts' speed; `by_thrust`: the wrench
    with it as a lag of the thrust. None without a lag, or where each thruster's command is not known at all times."""
    curve, configuration = file.vehicle.thrust_curve, file.vehicle.configurations[configuration_name]
    commands, lag_s = dive.thruster_commands, curve.lag_s
    known = commands is not None and tells_thrusters(dive, configuration)
    if lag_s <= 0.0 or not known or by_thrust.source != "pwm" or by_thrust.sampled_s > 0.0:
        return None
    if commands is None or unknown_between(dive, commands) or dive.reckoned is not None:
        return None
    asked = asked_thrusts(dive, file, configuration_name)
    allocation = allocation_matrix(configuration)
    wanted = Signal(asked.time_s, asked.value @ allocation.T)
    straight = history_of(wanted, curve, "pwm", (), dive.breaks_s)
    step = _steps(asked.time_s, lag_s / STEPS_A_LAG)
    time_s, thrust = _by_shafts(asked, step, lag_s, dive.breaks_s)
    start_s, end_s = time_s[:-1] + curve.delay_s, time_s[1:] + curve.delay_s
    # Pulses in whole microseconds are believed in part alone; the rest is as small for either lag.
    believed = by_thrust.mean_between(start_s, end_s) - straight.mean_between(start_s, end_s)
    value = thrust @ allocation.T
    value[:-1] += believed
    fine = history_of(Signal(time_s, value), replace(curve, lag_s=0.0), "pwm", by_thrust.notes, dive.breaks_s)
    return replace(fine, hidden=by_thrust.hidden, hidden_power=by_thrust.hidden_power)


def shafts_note(lag_s: float) -> str:
    """A note where a lag is taken for that of the shafts' speed."""
    return (
        f"The thrusters' lag of {lag_s:g} s is taken for that of their shafts' speed, whose square the thrust goes by: "
        "so the dive is likelier than with a lag of the thrust."
    )


def _steps(time_s: Array, longest_s: float) -> NDArray[np.intp]:
    """The number (n,) of even steps of `longest_s` at most from each command to the next; one after the last."""
    return np.append(np.maximum(np.ceil(np.diff(time_s) / longest_s), 1.0), 1.0).astype(np.intp)


def _by_shafts(asked: Signal, step: NDArray[np.intp], lag_s: float, breaks_s: Array) -> tuple[Array, Array]:
    """The begin of each step, and the thrust (m, k) amid it, of shafts whose speed follows that asked for."""
    span_s = np.append(np.diff(asked.time_s), 0.0)
    count = np.arange(step.sum()) - np.repeat(np.cumsum(step) - step, step)
    time_s = np.repeat(asked.time_s, step) + count * np.repeat(span_s / step, step)
    wanted = np.repeat(np.sign(asked.value) * np.sqrt(np.abs(asked.value)), step, axis=0)
    step_s = np.append(np.diff(time_s), 0.0)
    runs = np.split(np.arange(len(time_s)), np.searchsorted(time_s, breaks_s))
    decay = np.exp(-step_s / lag_s)
    speed = np.vstack([lagged_states(wanted[run], decay[run[:-1]]) for run in runs if len(run)])
    amid = wanted + (speed - wanted) * np.exp(-0.5 * step_s / lag_s)[:, None]
    return time_s, np.asarray(amid * np.abs(amid))
