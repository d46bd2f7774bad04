"""One control tick: navigation and reference to wrenches and thruster commands."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bridge.navigation import OLDEST_S, Navigation, known_at
from bridge.vehicle.accepted_effects import known_effects
from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import Vehicle
from bridge.vehicle.controller import GAINS, Controller, load_gains
from bridge.vehicle.feedforward import FEEDFORWARD_DOFS, FeedForward, Lead, Mode, Slope, feedforward, silent
from bridge.vehicle.onset import Onset
from bridge.vehicle.pulses import Array, Pulses
from bridge.vehicle.references import ZERO6, Push, Reference, Six, Trail
from bridge.vehicle.shadow import NONE_FLOWN, Shadow
from bridge.vehicle.supply import Supply
from bridge.vehicle.thrusters import NEUTRAL_US, Allocator, thrust_curve

RATE_HZ = 20.0
HOLD_AFTER_S = 5.0  # a DVL that lost the bottom for a moment is back by then
REFERENCE_STALE_S = 0.5  # ten ticks: a planner in another process that stumbles is back by then
NO_ARM = 1e-6

ParameterProvider = Callable[[int], Mapping[str, float]]


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


class Autopilot:
    """The controller of one vehicle in one configuration, stepped at 20 Hz.

    `parameters(veh_cfg)` gives the active coefficients by name. `directory` is where the vehicle file lies.
    Below the gain table's `straight_below_n`, thrusts run straight to 1500 us and are lost in the dead zone. Where
    the feed-forward is applied, the thrusters that it drives pass the dead zone (the table's `fed`): it is the
    vehicle's own model that asks for small thrusts, and nothing else makes up for what they lose. There, too, accepted
    effects of the thrusters are made up for: they are asked for what it takes to give the thrust that is wanted.

    Where PID and feed-forward fly together, the vehicle is to be where the reference is, not a lag behind: the
    feed-forward leads by the propellers' lag and half a period, and the PID compares each reading with what was
    wanted when that reading was true, so that it never pushes against the feed-forward. Left with the disturbance
    alone, it may be stiffer (the table's `fed`). All that comes with the feed-forward comes as slowly as its wrench,
    over half a second, and ends with it at once.

    A vehicle whose DVL or IMU is aboard but has told no velocity or heading for `HOLD_AFTER_S` gets no
    thrust in surge, sway and yaw, of the feed-forward neither, until it is heard again: heave, roll and
    pitch go on. So does one whose reference is that old by its stamp, or was stamped in the future for so long; the
    feed-forward is at zero after `REFERENCE_STALE_S` already. It needs no ground: a mission goes on where that falls
    silent.

    An axis that the reference pushes has neither PID nor feed-forward: the thrusters give the push itself, as far as
    they reach. A push that is no number is none: the controller keeps the axis.

    `unproven` says why the mode may not be raised while armed: what was flown in shadow has not shown it yet.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        configuration: str,
        parameters: ParameterProvider,
        directory: Path,
        mode: Mode = Mode.OFF,
        gains: Path = GAINS,
    ) -> None:
        self.mode = mode
        self.veh_cfg = vehicle.veh_cfg(vehicle.configuration_named(configuration))
        shape = vehicle.configurations[configuration]
        table = load_gains(shape.gains, gains)
        curve = thrust_curve(vehicle.thrust_curve, directory)
        self._parameters = parameters
        self._allocator = Allocator(shape, curve)
        self._reach = tuple(float(limit) for limit in self._allocator.reach())
        self._limits_n = (self._allocator.low_n, self._allocator.high_n)
        self._controller = Controller(table, shape, self._reach)
        self._shape = shape
        self._effects = known_effects({}, shape)
        self._without: tuple[str, ...] = ()
        self._coefficients: Mapping[str, float] = {}
        self._supply = Supply()
        self._pulses = Pulses(curve, table.straight_below_n)
        self._gain_beside = table.fed.gain
        driven = np.abs(self._allocator.matrix[list(FEEDFORWARD_DOFS)]).max(axis=0) > NO_ARM
        below_n = np.where(driven, table.fed.straight_below_n, table.straight_below_n)
        self._gentle_n = below_n
        self._pulses_fed = Pulses(curve, below_n)
        self._lead = Lead(vehicle.thrust_curve.lag_s + 0.5 / RATE_HZ, self._reach)
        self._slope = Slope(self._reach)
        self._onset = Onset()
        self._shadow = Shadow(self._reach)
        self._trail = Trail(OLDEST_S)
        self._saturated = False
        self._time_s = self._begun_s = math.nan
        self._has_dvl, self._has_imu = vehicle.sensors.dvl is not None, vehicle.sensors.imu is not None
        self._heard_s: dict[str, float] = {}
        self._faults: tuple[str, ...] = ()
        self._texts: list[str] = []

    def step(self, time_s: float, navigation: Navigation, reference: Reference) -> Actuation:
        """The commands of the tick at `time_s`; the PID of an axis whose sensor has fallen silent gives zero."""
        if math.isnan(self._begun_s):
            self._begun_s = time_s
        lost = self._lost(time_s, navigation, reference)
        pushes, no_pushes = _pushes(reference.push, self._reach)
        dt_s = time_s - self._time_s if self._time_s == self._time_s else 1 / RATE_HZ
        self._time_s = time_s
        known = known_at(navigation, time_s)
        self._trail.add(time_s, reference)
        together = self.mode is Mode.BOTH
        self._onset.step(self.mode.applies_feedforward, dt_s)
        wanted, gain = reference, 1.0
        if together:
            wanted, gain = self._wanted_then(reference, known), self._onset.between(1.0, self._gain_beside)
        pid = self._controller.step(known, wanted, dt_s, self._saturated, gain)
        if lost or not self.mode.applies_pid:
            self._controller.reset(FEEDFORWARD_DOFS)
            pid = tuple(0.0 if dof in FEEDFORWARD_DOFS else pid[dof] for dof in range(6))  # type: ignore[assignment]
        term = self._feedforward(time_s, reference)
        blind = _blind(known)
        self._report((*blind, *lost, *no_pushes, *term.faults, *self._without))
        led = self._lead.step(term.tau, dt_s)
        applied = self.mode.applies_feedforward and not lost
        pushed = list(pushes)
        off = (*term.off, *pushed) if applied else range(6)
        ff = np.array(self._slope.step(led if together else term.tau, off, dt_s))
        push = np.zeros(6)
        if pushed:
            self._controller.reset(pushed)
            pid = tuple(0.0 if dof in pushed else pid[dof] for dof in range(6))  # type: ignore[assignment]
            still = FEEDFORWARD_DOFS if lost else ()
            push[pushed] = [0.0 if dof in still else pushes[dof] for dof in pushed]
        thrust, commanded, scale = self._allocator.allocate(np.array(pid) + ff + push)
        supply = self._supplied(navigation.voltage_v, dt_s)
        losses = self._effects.losses if self.mode.applies_feedforward else None
        if losses is not None:
            made_up, share = losses.made_up(thrust, supply, self._gentle_n, self._limits_n)
            thrust, share = self._onset.between(thrust, made_up), self._onset.between(1.0, share)
            commanded, scale = share * commanded, share * scale
        self._saturated = scale < 1.0
        x, y, z, k, m, n = commanded.tolist()
        self._watch(dt_s, navigation, term, (x, y, z, k, m, n), bool(blind or lost), bool(pushed))
        pwm_us = tuple(self._pulse_widths(thrust).tolist())
        return self._told(time_s, navigation, reference, pid, term.tau, (x, y, z, k, m, n), pwm_us)

    def _pulse_widths(self, thrust_n: Array) -> Array:
        """Of thrusts (n,) in N, in microseconds. At the ends one law alone is asked: simulations are mostly this."""
        if self._onset.share == 0.0:
            return self._pulses(thrust_n)
        if self._onset.share == 1.0:
            return self._pulses_fed(thrust_n)
        return self._onset.between(self._pulses(thrust_n), self._pulses_fed(thrust_n))

    def rest(self, time_s: float, navigation: Navigation, reference: Reference) -> Actuation:
        """The tick of a disarmed vehicle: neutral pulses, integrals forgotten; the feed-forward is computed alone."""
        self._time_s, self._begun_s = time_s, math.nan
        self._saturated = False
        self._controller.reset(range(6))
        self._lead.reset()
        self._slope.reset()
        self._onset.step(False, 0.0)
        self._shadow.begin_anew()
        term = self._feedforward(time_s, reference)
        self._report((*term.faults, *self._without))
        neutral = (NEUTRAL_US,) * self._allocator.matrix.shape[1]
        return self._told(time_s, navigation, reference, ZERO6, term.tau, ZERO6, neutral)

    def unproven(self) -> str:
        """Why the feed-forward has not been good in shadow, "" where it has: for `ParameterServer.unproven`.

        Of the parameters in force at the moment of asking, which may be newer than the last tick's.
        """
        same = self._parameters(self.veh_cfg) == self._coefficients
        return self._shadow.fault if same else NONE_FLOWN

    def _watch(
        self, dt_s: float, navigation: Navigation, term: FeedForward, given: Six, lame: bool, pushed: bool
    ) -> None:
        """Keep what this tick shows of the feed-forward where it is flown in shadow."""
        at_limit = self._saturated or any(
            abs(term.tau[dof]) >= self._reach[dof] > NO_ARM for dof in FEEDFORWARD_DOFS
        )
        if self.mode is Mode.OFF:
            self._shadow.begin_anew()
        elif self.mode is not Mode.SHADOW:
            self._shadow.pause()
        elif lame:
            self._shadow.begin_anew("a lost sensor")
        elif len(term.off) == len(FEEDFORWARD_DOFS):
            self._shadow.begin_anew("FF was off")
        elif at_limit:
            self._shadow.begin_anew("thrust at a limit")
        elif pushed:
            self._shadow.begin_anew("a push")
        else:
            nu = (*navigation.velocity, *navigation.rate)
            self._shadow.step(dt_s, self._coefficients, self._effects.hull, given, term.tau, nu)

    def _feedforward(self, time_s: float, reference: Reference) -> FeedForward:
        """The term of this tick, with the effects that are now in force."""
        coefficients = self._parameters(self.veh_cfg)
        if coefficients != self._coefficients:
            self._shadow.begin_anew()
            self._coefficients = dict(coefficients)
            self._effects = known_effects(coefficients, self._shape)
            self._without = tuple(f"FF without {fault}" for fault in self._effects.faults)
        if abs(time_s - reference.time_s) > REFERENCE_STALE_S:
            return silent("the reference is stale")
        return feedforward(coefficients, reference, self._reach, self._effects.hull)

    def _supplied(self, voltage_v: float, dt_s: float) -> float:
        """The share of all thrust that the battery's voltage leaves."""
        law = self._effects.voltage
        return 1.0 if law is None else self._supply.step(law, voltage_v, dt_s)

    def _wanted_then(self, reference: Reference, known: Navigation) -> Reference:
        """The reference, in surge, sway and yaw that of the moment at which each reading was true."""
        u, v = self._trail.at(known.velocity_time_s).nu[:2]
        r = self._trail.at(known.rate_time_s).nu[5]
        heading_rad = self._trail.at(known.attitude_time_s).heading_rad
        return replace(reference, nu=(u, v, *reference.nu[2:5], r), heading_rad=heading_rad)

    def _lost(self, time_s: float, navigation: Navigation, reference: Reference) -> tuple[str, ...]:
        """Why there is no horizontal thrust, in words of 50 characters at most; empty where there is."""
        velocity_s = self._heard("velocity", navigation.velocity[:2], navigation.velocity_time_s)
        attitude_s = self._heard("attitude", navigation.attitude, navigation.attitude_time_s)
        rate_s = self._heard("rate", navigation.rate, navigation.rate_time_s)
        if reference.time_s <= time_s + REFERENCE_STALE_S:
            self._heard_s["reference"] = reference.time_s
        needed = (
            ("velocity", self._has_dvl, velocity_s),
            ("heading", self._has_imu, attitude_s),
            ("heading", self._has_imu, rate_s),
            ("reference", not math.isnan(reference.time_s), self._heard_s.get("reference", math.nan)),
        )
        lost = {
            what: f"no {what} for {HOLD_AFTER_S:.0f} s: no horizontal thrust"
            for what, aboard, last_s in needed
            # What was never heard is missed from the first armed tick on.
            if aboard and time_s - (last_s if last_s > self._begun_s else self._begun_s) > HOLD_AFTER_S
        }
        return tuple(lost.values())

    def _heard(self, what: str, values: Sequence[float], time_s: float) -> float:
        """When a reading was last a number: one that is none tells no more than silence."""
        if all(map(math.isfinite, values)):
            self._heard_s[what] = time_s
        return self._heard_s.get(what, math.nan)

    def _told(
        self,
        time_s: float,
        navigation: Navigation,
        reference: Reference,
        tau_pid: Six,
        tau_ff: Six,
        tau_cmd: Six,
        pwm_us: tuple[float, ...],
    ) -> Actuation:
        nu_fb = (*navigation.velocity, *navigation.rate)
        mode = int(self.mode)
        return Actuation(time_s, tau_pid, tau_ff, tau_cmd, nu_fb, reference, pwm_us, mode, self.veh_cfg)

    def take_texts(self) -> list[str]:
        """Status texts since the last call: each change in what controller and feed-forward can't do, said once."""
        texts, self._texts = self._texts, []
        return texts

    def _report(self, faults: tuple[str, ...]) -> None:
        if faults != self._faults:
            self._texts += [fault for fault in faults if fault not in self._faults]
            self._faults = faults


def _pushes(push: Push, reach: Sequence[float]) -> tuple[dict[int, float], tuple[str, ...]]:
    """The pushes to give, by axis, none beyond what the thrusters reach, and in words those that are no numbers."""
    asked = {dof: force for dof, force in enumerate(push) if force is not None}
    given = {dof: min(max(f, -reach[dof]), reach[dof]) for dof, f in asked.items() if math.isfinite(f)}
    return given, tuple(f"push in {DOFS[dof]} is no number: none given" for dof in asked if dof not in given)


def _blind(known: Navigation) -> tuple[str, ...]:
    """What the PID has to do without, in words. Short enough for a STATUSTEXT of 50 characters."""
    faults = []
    if not all(map(math.isfinite, known.velocity)):
        faults.append("PID surge, sway off: no velocity")
    if not math.isfinite(known.depth_m):
        faults.append("PID heave off: no depth")
    if not (math.isfinite(known.heading_rad) and all(map(math.isfinite, known.rate))):
        faults.append("PID roll, pitch, yaw off: no attitude")
    return tuple(faults)
