"""Why a recording can hardly be of this vehicle: its configuration, or a wrench that its thrusters don't give."""

import numpy as np

from bridge.vehicle.coefficients import DOFS, YAW
from bridge.vehicle.config import Vehicle
from identify.dive import Dive, Signal
from identify.thrust.wrench import obeyed_after_s
from identify.thrust.wrench_history import WrenchHistory

STRANGE_SHARE, TELLING_SHARE, FEWEST_TELLING = 0.2, 0.15, 20
"""A thrust curve is usually known to 10 %. A median difference of twice that between PWM and TAU_CMD means another
vehicle. A wrench below TELLING_SHARE of a thruster's limit (N, or N m) may lie in the dead band, so only larger
wrenches are compared, if there are at least FEWEST_TELLING."""

MOST_MADE_UP = 2.0
"""While the feed-forward is applied, the vehicle asks more of its thrusters than TAU_CMD, by the thrust that they were
found to lose: up to this multiple is no sign of another vehicle."""


def strange(dive: Dive, forces: WrenchHistory, vehicle: Vehicle, configuration_name: str) -> str:
    recorded = dive.configuration_index()
    if recorded is not None and recorded != vehicle.veh_cfg(configuration_name):
        return (
            f"the recording says VEH_CFG {recorded}, configuration '{configuration_name}' of vehicle "
            f"'{vehicle.name}' is {vehicle.veh_cfg(configuration_name)}: it was dived in another configuration, or is "
            "another vehicle's"
        )
    shares = _off_the_command(dive, forces, vehicle.configurations[configuration_name].thruster_limit_n)
    worst = max(shares, key=lambda dof: shares[dof], default=0)
    if shares and shares[worst] > STRANGE_SHARE:
        return (
            f"in {DOFS[worst]} its thruster commands come to a wrench {shares[worst]:.0%} off the recorded TAU_CMD: "
            "the vehicle file's thrusters are not this vehicle's"
        )
    return ""


def _off_the_command(dive: Dive, forces: WrenchHistory, limit_n: float) -> dict[int, float]:
    """Median relative difference between the wrench from PWM and TAU_CMD, by horizontal axis, over commands that are
    large enough."""
    if forces.source != "pwm" or dive.tau_cmd is None:
        return {}
    from_pwm = Signal(forces.time_s, forces.asked)
    asked = from_pwm.held_at(dive.tau_cmd.time_s + obeyed_after_s(from_pwm, dive.tau_cmd))
    shares, makes_up = {}, dive.feedforward_acts
    for dof in (0, 1, YAW):
        commanded = dive.tau_cmd.value[:, dof]
        # Small thrust lies in the thrusters' dead band, so a small command says nothing about the geometry.
        telling = np.isfinite(asked[:, dof]) & (np.abs(commanded) > TELLING_SHARE * limit_n)
        if np.count_nonzero(telling) >= FEWEST_TELLING:
            times = asked[telling, dof] / commanded[telling]
            made_up = makes_up & (times >= 1.0) & (times <= MOST_MADE_UP)
            shares[dof] = float(np.median(np.where(made_up, 0.0, np.abs(times - 1.0))))
    return shares
