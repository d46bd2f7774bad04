"""A real dive compared with a simulator's recording: its thrust, effects and numbers that the simulator must change.

Both recordings are diagnosed alike, each by its own commands, so these may differ. The gap is that of the simulator's
own model, parameters and effects, along the real dive. The thrust is compared first, because other thrust makes all
masses and drags come out otherwise; these are then compared at one thrust.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from bridge.vehicle.coefficients import DAMPINGS, DOFS, MASSES, QUADRATICS
from bridge.vehicle.config import VehicleFile
from identify.diagnose.diagnose import Progress, diagnose
from identify.diagnose.result import Diagnosis, Finding, Value, Verdict
from identify.diagnose.result import plain as plain_diagnosis
from identify.diagnose.shrink.shrunk import CHANCE, LIKELY
from identify.diagnose.simulators.simulator import priors_of, simulator_of
from identify.diagnose.simulators.thrust_ratio import LEAST_SHARE, SIGNIFICANT, ThrustRatio, thrust_ratio
from identify.diagnose.words.diagnosis import sorted_by_likelihood
from identify.dive import Dive
from identify.effects.effect import Effect
from identify.statistics import Z95

DRIFT_S = 5.0
"""Horizon of the drift in the answer."""

THRUST = "thrust_gain"
"""The effect that the ratio of the thrusts tells already, by degree of freedom."""

LEAST_DRIFT = 1.2
"""Least drift of a degree of freedom, relative to that with the vehicle's own numbers, for its numbers to matter."""


@dataclass(frozen=True)
class Difference:
    """A number that differs between simulator and vehicle.

    of: its effect, "" for the nominal model. probability: that this effect is present in both, 1 for the nominal
    model. thrust: ratio of the thrusts that is taken out of the vehicle's value. nats: evidence of the real dive
    against the simulator's value.
    """

    of: str
    name: str
    simulator: Value
    vehicle: Value
    probability: float = 1.0
    thrust: float = 1.0
    nats: float = 0.0

    @property
    def share(self) -> float:
        """Relative excess of the simulator's value."""
        return self.simulator.value / self.vehicle.value - 1.0


@dataclass(frozen=True)
class Against:
    """Comparison of a simulator with the vehicle, each diagnosed by a recording of its own.

    vehicle: the diagnosis of the real dive, with the simulator's gap. simulator: that of the simulator's recording.
    lacks: effects to add. has: effects in both, with the lower of both probabilities. spare: the simulator's own
    effects that the real dive does not show. differences: numbers to change, strongest evidence first. stories: causes
    that would explain differences of masses and dampings. untold: degrees of freedom with undetermined numbers in
    either recording. All may hold possible causes as well as likely causes. thrust: the vehicle's over the
    simulator's.
    """

    vehicle: Diagnosis
    simulator: Diagnosis
    lacks: tuple[Finding, ...]
    has: tuple[Finding, ...]
    spare: tuple[Finding, ...]
    differences: tuple[Difference, ...]
    stories: tuple[Finding, ...]
    untold: tuple[str, ...]
    thrust: ThrustRatio

    @property
    def causes(self) -> tuple[Finding, ...]:
        """Causes of the simulator's gap, strongest first, without effects that it already has."""
        of_gap = {id(item) for item in (*self.lacks, *self.stories)}
        return tuple(finding for finding in self.vehicle.findings if id(finding) in of_gap)

    @property
    def off(self) -> tuple[Difference, ...]:
        """The differing numbers, without those of merely possible effects."""
        return tuple(each for each in self.differences if each.probability >= LIKELY)

    @property
    def verdict(self) -> Verdict:
        """Verdict on the simulator's gap. Significant drift without a missing effect or a differing number is
        ambiguous."""
        if self.vehicle.verdict in ("partly", "unknown"):
            has_cause = self.vehicle.verdict == "partly" and (self.causes or self.off or self.thrust.differs)
            return "partly" if has_cause else "unknown"
        if self.causes or self.off or self.thrust.differs:
            return "ambiguous" if any(cause.also for cause in self.causes) else "explained"
        return "no_gap" if self.vehicle.gap.before < 1.0 + CHANCE else "ambiguous"


def against(
    real: Dive,
    sim: Dive,
    file: VehicleFile,
    sim_file: VehicleFile,
    configuration_name: str,
    *,
    effects: Sequence[Effect] | None = None,
    progress: Progress,
) -> Against:
    """Diagnose a real dive against a simulator's recording of the same vehicle, each by the file under its conditions.

    Raises FitError as `diagnose` does.
    """
    of_simulator = diagnose(
        sim,
        sim_file,
        configuration_name,
        effects=effects,
        progress=lambda share, words: progress(0.5 * share, words),
    )
    simulator = simulator_of(of_simulator)
    of_vehicle = diagnose(
        real,
        file,
        configuration_name,
        effects=effects,
        simulator=simulator,
        accepted=priors_of(simulator),
        progress=lambda share, words: progress(0.5 + 0.5 * share, words),
    )
    return compared(of_vehicle, of_simulator)


def compared(vehicle: Diagnosis, simulator: Diagnosis) -> Against:
    """The differences between the two diagnoses."""
    structural = [finding for finding in vehicle.findings if not finding.cause.effect.refit_absorbs]
    both = [(mine, _matching(mine, simulator.findings)) for mine in structural]
    lacks = tuple(mine for mine, its in both if its is None)
    pairs = [(mine, its) for mine, its in both if its is not None]
    has = tuple(replace(mine, probability=min(mine.probability, its.probability)) for mine, its in pairs)
    shared = {id(its) for _, its in pairs}
    spare = tuple(its for its in simulator.findings if id(its) not in shared and its.cause.effect.lasting)
    of_effects = [
        _difference(mine.name, name, its.parameters[name], value, min(mine.probability, its.probability))
        for mine, its in pairs
        if its.name == mine.name and mine.cause.effect.lasting
        for name, value in mine.parameters.items()
        if name in its.parameters and differ(its.parameters[name], value)
    ]
    its, mine = simulator.numbers, vehicle.numbers
    costs = _costs(vehicle)
    thrust = thrust_ratio(simulator, vehicle)
    nominal = [
        _difference("", each.name, its[each.name], at_its_thrust, 1.0, thrust.at(dof).value)
        for group in (MASSES, DAMPINGS, QUADRATICS)
        for dof, each in enumerate(group)
        if each.name in its
        and each.name in mine
        and costs[dof]
        and differ(its[each.name], at_its_thrust := _scaled(mine[each.name], thrust.at(dof)))
    ]
    untold = tuple(
        DOFS[dof]
        for dof in range(len(DOFS))
        if not (
            {MASSES[dof].name} <= its.keys() & mine.keys()
            and {DAMPINGS[dof].name, QUADRATICS[dof].name} & its.keys() & mine.keys()
        )
    )
    stories = tuple(
        finding
        for finding in vehicle.findings
        if finding.cause.effect.refit_absorbs and (nominal or (thrust.differs and finding.name == THRUST))
    )
    differences = sorted((*nominal, *of_effects), key=lambda each: -each.nats)
    return Against(vehicle, simulator, lacks, has, spare, tuple(differences), stories, untold, thrust)


def _difference(
    of: str, name: str, its: Value, mine: Value, probability: float, thrust: float = 1.0
) -> Difference:
    errors = Z95 * (its.value - mine.value) / max(_half_interval(mine, its), 1e-12 * abs(mine.value))
    return Difference(of, name, its, mine, probability, thrust, 0.5 * errors**2)


def _scaled(value: Value, by: Value) -> Value:
    """A mass or drag times a ratio of thrusts; the ends of its interval hold the ratio's error."""
    low = math.hypot(value.value - value.low95, value.value * (1.0 - by.low95 / by.value))
    high = math.hypot(value.high95 - value.value, value.value * (by.high95 / by.value - 1.0))
    middle = by.value * value.value
    return Value(middle, value.unit, middle - by.value * low, middle + by.value * high)


def plain(comparison: Against) -> dict[str, Any]:
    """The answer on the simulator's gap as plain data, with the changes to make under `against`.

    `has`: effects in both; `possible`: those of all effects that are less probable than not.
    """
    gap = comparison.vehicle.gap
    after = [drift.total for drift in gap.after if drift.horizon_s == DRIFT_S]
    groups = {
        "lacks": comparison.lacks,
        "has": comparison.has,
        "spare": comparison.spare,
        "stories": comparison.stories,
    }
    halves = {key: sorted_by_likelihood(findings) for key, findings in groups.items()}
    return plain_diagnosis(
        replace(comparison.vehicle, verdict=comparison.verdict, findings=comparison.causes)
    ) | {
        "against": {
            "simulator": comparison.simulator.dive,
            "thrust": {
                "ratio": _plain_value(comparison.thrust.whole),
                "by_axis": {dof: vars(value) for dof, value in comparison.thrust.by_axis.items()},
                "later": _plain_value(comparison.thrust.later),
                "differs": comparison.thrust.differs,
            },
            "drift": {"before": gap.before, "after": after[0] if after else None, "floor": 1},
            **{key: [item.name for item in likely] for key, (likely, _) in halves.items()},
            "possible": {key: [item.name for item in possible] for key, (_, possible) in halves.items()},
            "differences": [
                {
                    "of": each.of,
                    "name": each.name,
                    "simulator": vars(each.simulator),
                    "vehicle": vars(each.vehicle),
                    "probability": each.probability,
                    "thrust_taken_out": each.thrust,
                    "nats": each.nats,
                }
                for each in comparison.differences
            ],
            "untold": list(comparison.untold),
        }
    }


def _plain_value(value: Value | None) -> dict[str, Any] | None:
    return None if value is None else dict(vars(value))


def differ(value: Value, other: Value) -> bool:
    """Whether two values differ significantly and by enough to matter."""
    apart, spread = (
        abs(value.value - other.value),
        math.hypot(_half_interval(value, other), _half_interval(other, value)),
    )
    return bool(Z95 * apart > SIGNIFICANT * spread and apart > LEAST_SHARE * abs(other.value))


def _costs(vehicle: Diagnosis) -> list[bool]:
    """Whether each degree of freedom drifts more than with the vehicle's own numbers, over any horizon."""
    both = list(zip(vehicle.gap.drifts, vehicle.gap.after, strict=True))
    return [
        any(before.by_axis[dof] > LEAST_DRIFT * after.by_axis[dof] for before, after in both)
        for dof in range(len(DOFS))
    ]


def _half_interval(value: Value, towards: Value) -> float:
    """The half of its 95 % interval on the side of the other value."""
    return value.high95 - value.value if towards.value > value.value else value.value - value.low95


def _matching(mine: Finding, others: Sequence[Finding]) -> Finding | None:
    """The cause of the other recording that matches, or is ambiguous with, `mine`; None without one."""
    number = mine.cause.effect.number
    names = {mine.name, *mine.also}
    for finding in others:
        if finding.cause.effect.number == number and names & {finding.name, *finding.also}:
            return finding
    return None
