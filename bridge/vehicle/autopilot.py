"""One control tick: navigation and reference to wrenches and thruster commands."""

from dataclasses import dataclass

from bridge.vehicle.references import Reference, Six


@dataclass(frozen=True, slots=True)
class Actuation:
    """What the controller did in one tick.

    Wrenches are X Y Z K M N in N and N m: `tau_pid` of the feedback, `tau_ff` of the feed-forward (also
    where it is not applied), `tau_cmd` what the thrusters were asked for, after limits. `nu_fb` is the very
    velocity that the controller used. `pwm_us` is in the order of the vehicle's file. `mode` is FF_MODE,
    `veh_cfg` VEH_CFG.
    """

    time_s: float
    tau_pid: Six
    tau_ff: Six
    tau_cmd: Six
    nu_fb: Six
    reference: Reference
    pwm_us: tuple[float, ...]
    mode: int
    veh_cfg: int
