"""One control tick: turns navigation and reference into wrenches and thruster commands."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bridge.arrays import Array
from bridge.errors import ConfigError
from bridge.vehicle.accepted_effects import Supply
from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import Vehicle
from bridge.vehicle.controller import GAINS, Controller, load_gains
from bridge.vehicle.feedforward import FEEDFORWARD_DOFS, FeedForward, Lead, Onset, Slope, feedforward, silent
from bridge.vehicle.in_force import FaultTexts, ModelInForce, ParameterProvider
from bridge.vehicle.mode import Mode
from bridge.vehicle.navigation import OLDEST_S, Navigation, known_at
from bridge.vehicle.references import ZERO6, Push, Reference, Six, Trail
from bridge.vehicle.thrusters import NEUTRAL_US, Allocator, Pulses, thrust_curve
from bridge.wire.status_codes import Topic, coded

RATE_HZ = 20.0
HOLD_AFTER_S = 5.0  # long enough for a DVL to regain bottom lock
REFERENCE_STALE_S = 0.5  # ten ticks: long enough for a planner in another process to catch up
PAUSE_S = 1.0  # after a longer one, as between two flights, nothing of the flight before holds
NO_ARM = 1e-6


@dataclass(frozen=True, slots=True)
class Actuation:
    """Result of one control tick.

    Wrenches are X Y Z K M N in N and N m: `tau_pid` from the feedback, `tau_ff` from the feed-forward (computed even
    if it is not applied), `tau_cmd` the wrench that the thrusters were asked for, after limits. `nu_fb` is the very
    velocity that the controller was given; its PID ignores values older than `OLDEST_S`. `pwm_us` follows the
    thruster order of the vehicle file. `mode` is FF_MODE, `veh_cfg` VEH_CFG.
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
    """The controller of a vehicle in one configuration, stepped at 20 Hz.

    `parameters(veh_cfg)` returns the active coefficients by name. `directory` is the folder of the vehicle file.
    Thrusts below the gain table's `straight_below_n` map to pulse widths on a straight line to 1500 us and are lost
    in the dead zone. While the feed-forward is applied, the thrusters that it drives jump over the dead zone (limit
    in the table's `fed`): the vehicle model itself asks for small thrusts, and nothing else compensates their loss.
    Accepted thruster effects are then compensated as well: each thruster is asked for as much as it needs to deliver
    the wanted thrust.

    When PID and feed-forward fly together, the vehicle should follow the reference without lag. The feed-forward
    leads by the propeller lag and half a period. The PID compares each reading with the reference at the time when
    that reading was valid, so that it never pushes against the feed-forward. It then has only disturbances to correct
    and may be stiffer (the table's `fed`). All changes that come with the feed-forward fade in with its wrench over
    half a second and end with it at once.

    If the DVL or the IMU is fitted but has given no velocity or heading for `HOLD_AFTER_S`, surge, sway and yaw get
    no thrust, not even from the feed-forward, until readings return; heave, roll and pitch continue. The same holds
    if the reference is that old by its stamp; a reading or a reference that is stamped in the future counts for
    none. The feed-forward is zero after `REFERENCE_STALE_S` without a reference already. The ground station is not
    needed: a mission continues if it falls silent.

    An axis that the reference pushes has neither PID nor feed-forward: the thrusters give the pushed wrench itself,
    within their reach. A push that is not finite is ignored, and the controller keeps the axis.

    It begins anew, as after `rest`, where it was not stepped for longer than `PAUSE_S`, or its clock was set back: a
    program that does not call `rest` between two flights must not have the time between them integrated.

    `unproven` says why the mode may not be raised while armed: shadow flight has not shown the feed-forward to be
    good.
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
        if curve.neutral_us != NEUTRAL_US:
            raise ConfigError(
                f"thrust_curve: neutral_us is {curve.neutral_us:g}, and the bridge holds a thruster at rest by "
                f"{NEUTRAL_US:g} us alone; set the speed controllers to that"
            )
        self._allocator = Allocator(shape, curve)
        self._reach = tuple(float(limit) for limit in self._allocator.reach())
        self._limits_n = (self._allocator.low_n, self._allocator.high_n)
        self._controller = Controller(table, shape, self._reach)
        self._model = ModelInForce(parameters, self.veh_cfg, shape, self._reach)
        self._without: tuple[str, ...] = ()
        self._supply = Supply()
        self._pulses = Pulses(curve, table.straight_below_n)
        self._fed_gain = table.fed.gain
        driven = np.abs(self._allocator.matrix[list(FEEDFORWARD_DOFS)]).max(axis=0) > NO_ARM
        below_n = np.where(driven, table.fed.straight_below_n, table.straight_below_n)
        self._gentle_n = below_n
        self._pulses_fed = Pulses(curve, below_n)
        self._lead = Lead(vehicle.thrust_curve.lag_s + 0.5 / RATE_HZ, self._reach)
        self._slope = Slope(self._reach)
        self._onset = Onset()
        self._trail = Trail(OLDEST_S)
        self._saturated = False
        self._time_s = self._begun_s = math.nan
        self._has_dvl, self._has_imu = vehicle.sensors.dvl is not None, vehicle.sensors.imu is not None
        self._heard_s: dict[str, float] = {}
        self._faults = FaultTexts()

    def step(self, time_s: float, navigation: Navigation, reference: Reference) -> Actuation:
        """Return the commands of the tick at `time_s`; the PID gives zero on an axis whose sensor has fallen silent."""
        if math.isnan(self._begun_s):
            self._begun_s = time_s
        lost = self._lost(time_s, navigation, reference)
        pushes, no_pushes = _pushes(reference.push, self._reach)
        dt_s = time_s - self._time_s
        if not 0.0 <= dt_s <= PAUSE_S:
            self._begin_anew()
            self._model.shadow.begin_anew("a pause")
            dt_s = 1 / RATE_HZ
        self._time_s = time_s
        known = known_at(navigation, time_s)
        self._trail.add(time_s, reference)
        together = self.mode is Mode.BOTH
        self._onset.step(self.mode.applies_feedforward, dt_s)
        wanted, gain = reference, 1.0
        if together:
            wanted, gain = self._wanted_then(reference, known), self._onset.between(1.0, self._fed_gain)
        pid = self._controller.step(known, wanted, dt_s, self._saturated, gain)
        if lost or not self.mode.applies_pid:
            self._controller.reset(FEEDFORWARD_DOFS)
            pid = tuple(0.0 if dof in FEEDFORWARD_DOFS else pid[dof] for dof in range(6))  # type: ignore[assignment]
        term = self._feedforward(time_s, reference)
        blind = _blind(known)
        self._faults.report((*blind, *lost, *no_pushes, *term.faults, *self._without))
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
        losses = self._model.effects.losses if self.mode.applies_feedforward else None
        if losses is not None:
            made_up, share = losses.made_up(thrust, supply, self._gentle_n, self._limits_n)
            thrust, share = self._onset.between(thrust, made_up), self._onset.between(1.0, share)
            commanded, scale = share * commanded, share * scale
        self._saturated = scale < 1.0
        x, y, z, k, m, n = commanded.tolist()
        obstacle = self._obstacle(term, bool(blind or lost), bool(pushed))
        self._model.judge(self.mode, obstacle, dt_s, (x, y, z, k, m, n), term.tau, navigation)
        pwm_us = tuple(self._pulse_widths(thrust).tolist())
        return self._actuation(time_s, navigation, reference, pid, term.tau, (x, y, z, k, m, n), pwm_us)

    def _pulse_widths(self, thrust_n: Array) -> Array:
        """Pulse widths in microseconds for thrusts (n,) in N. Before and after the onset only one of the two curves
        is evaluated, because simulations spend most of their time here."""
        if self._onset.share == 0.0:
            return self._pulses(thrust_n)
        if self._onset.share == 1.0:
            return self._pulses_fed(thrust_n)
        return self._onset.between(self._pulses(thrust_n), self._pulses_fed(thrust_n))

    def rest(self, time_s: float, navigation: Navigation, reference: Reference) -> Actuation:
        """Return the tick of a disarmed vehicle: neutral pulses, integrals reset; the feed-forward is computed, not
        applied."""
        self._time_s, self._begun_s = time_s, math.nan
        self._begin_anew()
        self._model.shadow.begin_anew()
        term = self._feedforward(time_s, reference)
        self._faults.report((*term.faults, *self._without))
        neutral = (NEUTRAL_US,) * self._allocator.matrix.shape[1]
        return self._actuation(time_s, navigation, reference, ZERO6, term.tau, ZERO6, neutral)

    def unproven(self) -> str:
        """See `ModelInForce.unproven`."""
        return self._model.unproven()

    def _begin_anew(self) -> None:
        """Forget what the ticks before have left."""
        self._saturated = False
        self._controller.reset(range(6))
        self._lead.reset()
        self._slope.reset()
        self._onset.step(False, 0.0)

    def _obstacle(self, term: FeedForward, lame: bool, pushed: bool) -> str:
        """Why this tick is no evidence for or against the feed-forward, "" if it is."""
        if lame:
            return "a lost sensor"
        if len(term.off) == len(FEEDFORWARD_DOFS):
            return "FF was off"
        if self._saturated or any(
            abs(term.tau[dof]) >= self._reach[dof] > NO_ARM for dof in FEEDFORWARD_DOFS
        ):
            return "thrust at a limit"
        return "a push" if pushed else ""

    def _feedforward(self, time_s: float, reference: Reference) -> FeedForward:
        """Return this tick's feed-forward term, after taking over any change of the coefficients and accepted
        effects."""
        if self._model.renew():
            self._without = tuple(
                coded(Topic.SET_FAULT, f"FF without {fault}") for fault in self._model.effects.faults
            )
            self._faults.begin_set()
        if abs(time_s - reference.time_s) > REFERENCE_STALE_S:
            return silent("the reference is stale")
        return feedforward(self._model.coefficients, reference, self._reach, self._model.effects.hull)

    def _supplied(self, voltage_v: float, dt_s: float) -> float:
        """Share of all thrust that is left at the battery's voltage."""
        law = self._model.effects.voltage
        return 1.0 if law is None else self._supply.step(law, voltage_v, dt_s)

    def _wanted_then(self, reference: Reference, known: Navigation) -> Reference:
        """The reference, with surge, sway and yaw taken at the moments when the respective readings were valid."""
        u, v = self._trail.at(known.velocity_time_s).nu[:2]
        r = self._trail.at(known.rate_time_s).nu[5]
        heading_rad = self._trail.at(known.attitude_time_s).heading_rad
        return replace(reference, nu=(u, v, *reference.nu[2:5], r), heading_rad=heading_rad)

    def _lost(self, time_s: float, navigation: Navigation, reference: Reference) -> tuple[str, ...]:
        """Reasons for withholding horizontal thrust, at most 50 characters each; empty if thrust is allowed."""
        latest_s = time_s + OLDEST_S
        velocity_s = self._heard("velocity", navigation.velocity[:2], navigation.velocity_time_s, latest_s)
        attitude_s = self._heard("attitude", navigation.attitude, navigation.attitude_time_s, latest_s)
        rate_s = self._heard("rate", navigation.rate, navigation.rate_time_s, latest_s)
        if reference.time_s <= time_s + REFERENCE_STALE_S:
            self._heard_s["reference"] = reference.time_s
        needed = (
            ("velocity", self._has_dvl, velocity_s),
            ("heading", self._has_imu, attitude_s),
            ("heading", self._has_imu, rate_s),
            ("reference", not math.isnan(reference.time_s), self._heard_s.get("reference", math.nan)),
        )
        lost = {
            quantity: f"no {quantity} for {HOLD_AFTER_S:.0f} s: no horizontal thrust"
            for quantity, aboard, last_s in needed
            # For a quantity never received, the time counts from the first armed tick.
            if aboard and time_s - (last_s if last_s > self._begun_s else self._begun_s) > HOLD_AFTER_S
        }
        return tuple(lost.values())

    def _heard(self, name: str, values: Sequence[float], time_s: float, latest_s: float) -> float:
        """Return when the reading was last finite; one that is not finite, or later than `latest_s`, counts as
        silence."""
        if all(map(math.isfinite, values)) and time_s <= latest_s:
            self._heard_s[name] = time_s
        return self._heard_s.get(name, math.nan)

    def _actuation(
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
        """Return the status texts since the last call: each new fault of controller or feed-forward, reported once."""
        return self._faults.take()


def _pushes(push: Push, reach: Sequence[float]) -> tuple[dict[int, float], tuple[str, ...]]:
    """Return the finite pushes by axis, limited to the thrusters' reach, and a text for each push that is not
    finite."""
    asked = {dof: force for dof, force in enumerate(push) if force is not None}
    given = {dof: min(max(f, -reach[dof]), reach[dof]) for dof, f in asked.items() if math.isfinite(f)}
    return given, tuple(f"push in {DOFS[dof]} is no number: none given" for dof in asked if dof not in given)


def _blind(known: Navigation) -> tuple[str, ...]:
    """List the PID axes that are off for lack of a reading. Short enough for a STATUSTEXT of 50 characters."""
    faults = []
    if not all(map(math.isfinite, known.velocity)):
        faults.append("PID surge, sway off: no velocity")
    if not math.isfinite(known.depth_m):
        faults.append("PID heave off: no depth")
    if not (math.isfinite(known.heading_rad) and all(map(math.isfinite, known.rate))):
        faults.append("PID roll, pitch, yaw off: no attitude")
    return tuple(faults)
