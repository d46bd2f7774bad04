"""Whether each thruster command of a dive holds until the next, or is a sample of a faster loop, by its thrust.

Thrust of samples acts half a step earlier than that of commands that hold. Where the dive does not tell which, a late
thrust is as uncertain as that.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.config import VehicleFile
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.filters.nominal import Nominal
from identify.diagnose.filters.slow_samples import MOST_LATE, is_early
from identify.diagnose.lateness import tests_of
from identify.diagnose.nominal_fit import fitted_nominal
from identify.diagnose.result import Finding, Value
from identify.diagnose.words.causes import SINCE, effect_words
from identify.dive import Dive, Signal
from identify.effects.effect import Effect, Parameter
from identify.estimators.timing.sampled_commands import with_samples
from identify.estimators.timing.thrust_delay import likeliest_delay
from identify.ingest.commands import commands_of_unknown_loop, holding_variance_s2, sampled_slowly
from identify.thrust.wrench import wrench
from identify.words import capital, with_interval

LEAST_GAIN, LEAST_OF_EACH = 7.0, 0.1
"""Nats by which commands must be likelier to be samples; and for each command, by which they must be likelier to hold.
"""

HELD = 0.3
"""Share of the step between two commands: thrust that acts later than by this is none of a faster loop."""


@dataclass(frozen=True)
class SlowLoop:
    """A dive with delayed thrust whose commands come at a low rate: with commands that hold or are samples of a faster
    loop, where one of both is far likelier, and its nominal fit.

    most_s: the most of a delay that may be none: half the step of the course, whose instants hold the mean thrust up to
    the next, and of samples, which are taken to change evenly, half the step of the loop behind them.
    """

    dive: Dive
    nominal: Nominal
    most_s: float

    def without_step(self, findings: Sequence[Finding]) -> tuple[Finding, ...]:
        """The findings, of which a late thrust is less by none to `most_s`, beyond the delay that the nominal fit
        has. A change of an accepted one is of a dive with the same step."""
        return tuple(
            replace(finding, parameters={name: self._less(of) for name, of in finding.parameters.items()})
            if finding.cause.effect.timing and finding.cause.effect.variant != SINCE
            else finding
            for finding in findings
        )

    def _less(self, late: Value) -> Value:
        ends = np.array([late.value - 0.5 * self.most_s, late.low95 - self.most_s, late.high95])
        value, low, high = np.maximum(ends + self.nominal.late_samples_s, 0.0).tolist()
        return Value(value, late.unit, low, high)


@dataclass(frozen=True)
class Loop:
    """A dive whose commands are taken to hold until the next, or for samples of a faster loop, as its thrust shows.

    nominal: its nominal fit. as_recorded: the dive before it was judged. slow: of delayed commands at a low rate.
    """

    dive: Dive
    nominal: Nominal
    as_recorded: Dive
    slow: SlowLoop | None

    def like(self, check: Dive) -> Dive:
        """A check dive with its commands taken as the dive's."""
        return (
            check if self.dive is self.as_recorded else replace(check, commands_hold=self.dive.commands_hold)
        )

    def able(self, effects: Sequence[Effect]) -> tuple[Effect, ...]:
        """The effects of which this dive can tell: by samples, a quicker thruster where thrust is early as a whole."""
        sampled = self.slow is None and self.dive.commands_hold is False
        early = is_early(self.nominal.late_samples_s, self.nominal.joint)
        return not_quicker(effects) if sampled and not early else tuple(effects)

    def known(self, covariance: Array, causes: Sequence[Cause]) -> Array:
        """The covariance (k, k) of causes' present parameters, with the doubt about the time between two commands."""
        return with_holding_unknown(covariance, causes, self.as_recorded) if self.slow is None else covariance

    def beyond(self, findings: Sequence[Finding]) -> tuple[tuple[Finding, ...], tuple[Finding, ...]]:
        """The causes among findings, and those that the time between two commands may explain."""
        if self.slow is None:
            return beyond_step(findings, self.as_recorded)
        return self.slow.without_step(findings), ()


def judged_loop(dive: Dive, file: VehicleFile, configuration: str) -> Loop:
    """Judge how the commands of a dive are to be taken; raises FitError as `fitted_nominal` does."""
    now = fitted_nominal(dive, file, configuration)
    known = with_known_holding(dive, now)
    if known is not dive:
        now = fitted_nominal(known, file, configuration)
    slow = slow_loop(known, now, file, configuration)
    return Loop(known, now, dive, None) if slow is None else Loop(slow.dive, slow.nominal, dive, slow)


def slow_loop(dive: Dive, now: Nominal, file: VehicleFile, configuration: str) -> SlowLoop | None:
    """Judge commands at a low rate, each way at its likeliest delay; None if they come fast, or are not delayed.

    Commands of the loop itself leave next to nothing; of samples, a faster loop's jumps can be a little more like a
    hold. Samples are of a loop at least twice as fast.
    """
    commands = commands_of_unknown_loop(dive)
    if commands is None or not _is_slow_and_delayed(commands, dive, now):
        return None
    held, gain = replace(dive, commands_hold=True), 0.0
    by_held = fitted_nominal(held, file, configuration)
    # Without a solution neither is likelier.
    with suppress(np.linalg.LinAlgError):
        gain = _at_likeliest_delay(held, by_held, file, configuration) - _at_likeliest_delay(
            dive, now, file, configuration
        )
    step_s, least_s = 1.0 / commands.rate_hz, 0.5 * now.course.step_s
    if gain > LEAST_OF_EACH * len(commands):
        note = "Each thruster command is taken to hold until the next: so the late thrust is far likelier."
        return SlowLoop(_noted(held, note), by_held, least_s)
    if gain < -LEAST_GAIN:
        note = "Thruster commands are taken for samples of a faster loop: so the late thrust is likelier."
        return SlowLoop(_noted(replace(dive, commands_hold=False), note), now, least_s + 0.25 * step_s)
    note = (
        f"The motion does not tell whether each thruster command holds until the next, and a delay is known to half a "
        f"step of them, {0.5 * step_s:.2g} s: if you know, say `commands_hold` in the column map."
    )
    return SlowLoop(_noted(dive, note), now, least_s + 0.5 * step_s)


def _noted(dive: Dive, note: str) -> Dive:
    return replace(dive, notes=(*dive.notes, note))


def _is_slow_and_delayed(commands: Signal, dive: Dive, now: Nominal) -> bool:
    # Behind an autopilot's filter the delay is that at which its velocity was dated.
    return sampled_slowly(commands) and now.late_thrust_s[0] > 0.0 and not dive.velocity_is_filtered


def _at_likeliest_delay(dive: Dive, now: Nominal, file: VehicleFile, configuration: str) -> float:
    forces = wrench(dive, file, configuration)
    return likeliest_delay(forces, now.built, now.joint, now.theta, now.late_thrust_s[0])[1]


def with_known_holding(dive: Dive, now: Nominal) -> Dive:
    """The dive with commands that hold, or are samples of a faster loop, where its thrust shows other than their rate.

    A delay of the thrusters hides samples, and can look like commands that hold. Where the controller logs its wrench
    the loop is known.
    """
    commands = commands_of_unknown_loop(dive)
    if commands is None or _is_slow_and_delayed(commands, dive, now):
        return dive
    step_s = 1.0 / commands.rate_hz
    if sampled_slowly(commands):
        held = HELD * step_s < now.late_samples_s < MOST_LATE * step_s
        return replace(dive, commands_hold=True) if held else dive
    return with_samples(dive, tests_of(now))


def not_quicker(effects: Sequence[Effect]) -> tuple[Effect, ...]:
    """The effects, of which no thruster is quicker than the vehicle file says.

    Between samples the thrust goes straight. Through the controller the later of two samples answers the readings
    before it, and a quicker thrust passes for that answer.
    """

    def slower(effect: Effect) -> Effect:
        return replace(effect, parameters=tuple(replace(each, low=each.none) for each in effect.parameters))

    return tuple(slower(effect) if effect.timing else effect for effect in effects)


def with_holding_unknown(covariance: Array, causes: Sequence[Cause], dive: Dive) -> Array:
    """The covariance (k, k) of causes' present parameters, where that of a late thrust is as uncertain as whether each
    command holds until the next."""
    late = [bool(cause.effect.timing) for cause in causes for present in cause.present if present]
    return covariance + np.diag(np.array(late, np.float64) * holding_variance_s2(dive))


def beyond_step(findings: Sequence[Finding], dive: Dive) -> tuple[tuple[Finding, ...], tuple[Finding, ...]]:
    """The causes among findings, and the others: each a late thrust that may be none within its interval, as wide as
    the unknown between two commands makes it. A change of an accepted one is a cause as it is."""

    def holds_none(finding: Finding) -> bool:
        effect = finding.cause.effect
        if not effect.timing or effect.variant == SINCE:
            return False
        (parameter,) = effect.parameters
        value = finding.parameters.get(parameter.name)
        return value is not None and value.low95 <= parameter.none <= value.high95

    if holding_variance_s2(dive) == 0.0:
        return tuple(findings), ()
    by_step = [holds_none(finding) for finding in findings]
    beyond, within = (
        tuple(finding for finding, within in zip(findings, by_step, strict=True) if within is wanted)
        for wanted in (False, True)
    )
    return beyond, within


def within_step_note(within: Sequence[Finding], dive: Dive) -> tuple[str, ...]:
    """A sentence on each late thrust that the unknown between two commands may be, and what a crew can say of them."""
    known = dive.commands_hold is not None
    say = "" if known else " If each command holds until the next, say `commands_hold` in the column map."
    return tuple(f"{_within_step(each, each.cause.effect.parameters[0])}{say}" for each in within)


def _within_step(finding: Finding, parameter: Parameter) -> str:
    value = finding.parameters[parameter.name]
    number, interval = with_interval(value.value, value.low95, value.high95)
    return (
        f"{capital(effect_words(finding.cause.effect))} is no cause: with {number} s (95 %: {interval}) the dive is "
        f"likelier than with the vehicle file's {parameter.none:g} s, but what is unknown of the thrust between two "
        "commands does as much."
    )
