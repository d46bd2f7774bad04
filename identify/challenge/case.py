"""`draw_case(seed)`: a vehicle with hidden effects and two dives of it, with the truth in the form of an answer."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np

from bridge.errors import LogError
from bridge.vehicle.coefficients import DAMPINGS, DOFS, MASSES
from bridge.vehicle.config import VehicleFile
from identify.challenge.indistinguishable import alike
from identify.challenge.mission import DEPTH, LONGEST_S, SHORTEST_S, draw_mission, reference_at
from identify.challenge.nearest_parameters import nearest, sizes
from identify.challenge.novel_effects import NOVEL
from identify.challenge.planted_effects import ABSORBED, BY_NAME_ALONE, PLANTS
from identify.challenge.scenario import Planted, Scenario, scenario_of
from identify.challenge.sensors import STEP_S, draw_noise, draw_periods
from identify.challenge.simulate import Setup, Simulated, draw_control, simulate
from identify.challenge.vehicles import DrawnVehicle, draw_vehicle
from identify.dive import Dive

Kind = Literal["none", "one", "two", "novel"]

SHARES: dict[Kind, float] = {"none": 0.25, "one": 0.4, "two": 0.2, "novel": 0.15}

SPOILT_SHARE = 0.5
"""A degree of freedom counts as a right answer if its size is at least this share of the largest."""

ROUNDING = 1e-6
"""Size over the floor below which there is nothing but the computer's rounding."""

UNDETECTABLE = frozenset([*ABSORBED, *BY_NAME_ALONE, "wrong_feedback_log"])
"""Effects that leave no trace of their own, so that they are planted neither in pairs nor as unknown."""


@dataclass(frozen=True)
class Case:
    """A vehicle with its hidden effects. Its two missions (`dive_of`, `check_of`) are simulated when first asked for.

    without: effects that the diagnosing library must lack; when planted, they are as unknown as those of NOVEL.
    """

    name: str
    seed: int
    kind: Kind
    vehicle: DrawnVehicle
    planted: tuple[Planted, ...]
    setup: Setup
    seconds: tuple[float, float]
    without: tuple[str, ...] = ()

    @property
    def file(self) -> VehicleFile:
        return self.vehicle.file

    @property
    def configuration(self) -> str:
        return str(self.vehicle.file.configuration)

    @cached_property
    def _dives(self) -> dict[int, tuple[Scenario, Simulated]]:
        return {}

    def simulated(self, which: int) -> tuple[Scenario, Simulated]:
        """The scenario and the simulated dive: 0 is the dive to diagnose, 1 the check dive."""
        if which not in self._dives:
            self._dives[which] = _simulated(self, which)
        return self._dives[which]

    def truth(self) -> dict[str, Any]:
        """The truth as plain data: kind, effects with parameters and size, degrees of freedom, true nominal model.

        `parameters` are those with which the library's form comes nearest to the planted effect over the dive to
        diagnose.

        `size` is how far the effect exceeds the noise floor of the dive to diagnose after a refit: for all effects
        together and, if there are two, for each in a dive of its own. `dof` lists the degrees of freedom with at
        least half of the largest size, or whose reading an effect spoils.
        """
        scenario, simulated = self.simulated(0)
        by_dof = sizes(scenario, self.setup.noise, simulated)
        largest = float(by_dof.max())
        spoilt = {dof for planted in self.planted for dof in planted.spoils}
        least = max(SPOILT_SHARE * largest, ROUNDING)
        affected = [name for i, name in enumerate(DOFS) if by_dof[i] >= least or i in spoilt]
        values = np.concatenate([self.vehicle.mass, self.vehicle.damping]).tolist()
        return {
            "name": self.name,
            "kind": self.kind,
            "vehicle": self.configuration,
            "rpm": self.setup.has_rpm,
            "poles": self.vehicle.poles,
            "effects": [
                {
                    "name": p.name,
                    "number": p.number,
                    "novel": p.novel,
                    "drawn": p.size,
                    "size": largest if len(self.planted) == 1 else self._size_alone(p),
                    "parameters": parameters,
                }
                for p, parameters in zip(
                    self.planted, nearest(self.planted, scenario, simulated), strict=True
                )
            ],
            "size": largest if self.planted else 0.0,
            "size_by_dof": dict(zip(DOFS, by_dof.tolist(), strict=True)),
            "dof": affected if self.planted else [],
            "without": list(self.without),
            "nominal": dict(zip([c.name for c in (*MASSES, *DAMPINGS)], values, strict=True)),
        }

    def _size_alone(self, planted: Planted) -> float:
        scenario, simulated = _simulated(replace(self, planted=(planted,)), 0)
        return float(sizes(scenario, self.setup.noise, simulated).max())


def dive_of(case: Case) -> Dive:
    """The dive to diagnose, in memory."""
    return case.simulated(0)[1].dive


def check_of(case: Case) -> Dive:
    """Another mission of the same vehicle, with the same hidden effects."""
    return case.simulated(1)[1].dive


def left_out(name: str) -> tuple[str, ...]:
    """Names that a library must lack for this effect to be unknown to it: its own, and those of its true class.

    Raises LogError if PLANTS lacks the effect, or if it leaves no trace of its own (UNDETECTABLE).
    """
    if name not in PLANTS or name in UNDETECTABLE:
        able = ", ".join(sorted(set(PLANTS) - UNDETECTABLE))
        raise LogError(f"'{name}' is no effect that can be planted as unknown; name one of {able}")
    return tuple(sorted(alike(name, rpm=False)))


def draw_case(
    seed: int,
    *,
    name: str | None = None,
    kind: Kind | None = None,
    names: Sequence[str] | None = None,
    without: Sequence[str] = (),
    size: float | None = None,
    seconds: float | None = None,
    rpm: bool | None = None,
) -> Case:
    """Draw the case of a seed; options left at None are drawn.

    `kind` sets how many effects are hidden, `names` which (of PLANTS and NOVEL; an empty list hides none), `size` (0
    to 1) how large they are, `seconds` the length of both dives, `rpm` whether shaft speeds are recorded. Effects in
    `without` (see `left_out`) make up half of the unknown effects and are drawn nowhere else.
    """
    rng = np.random.default_rng([seed, 20])
    name = name or f"case-{seed}"
    vehicle = draw_vehicle(rng, name)
    drawn_kind = str(rng.choice(list(SHARES), p=list(SHARES.values())))
    chosen = _names(rng, kind or drawn_kind, without)
    setup = Setup(draw_periods(rng), draw_noise(rng), draw_control(rng, vehicle), bool(rng.random() < 0.5))
    long_s = rng.uniform(SHORTEST_S, LONGEST_S), rng.uniform(SHORTEST_S, SHORTEST_S + 60.0)
    drawn = rng.uniform(0.0, 1.0, 4)
    if names is not None:
        chosen = tuple(names)
    if rpm is not None:
        setup = Setup(setup.periods, setup.noise, setup.control, rpm)
    known: dict[str, Any] = {**PLANTS, **NOVEL}
    planted = tuple(
        known[which](np.random.default_rng([seed, 21, i]), vehicle, float(drawn[i] if size is None else size))
        for i, which in enumerate(chosen)
    )
    planted = tuple(replace(p, novel=p.novel or p.name in without) for p in planted)
    pair = long_s if seconds is None else (seconds, seconds)
    return Case(name, seed, _kind(planted), vehicle, planted, setup, pair, tuple(without))


def _names(rng: np.random.Generator, kind: str, without: Sequence[str]) -> tuple[str, ...]:
    if kind == "none":
        return ()
    if kind == "novel":
        lacking = bool(without) and rng.random() < 0.5
        return (str(rng.choice(list(without if lacking else NOVEL))),)
    if kind == "one":
        kept = {*BY_NAME_ALONE, *without}
        return (str(rng.choice([name for name in PLANTS if name not in kept])),)
    able = [name for name in PLANTS if name not in UNDETECTABLE and name not in without]
    while True:
        pair = tuple(str(name) for name in rng.choice(able, 2, replace=False))
        if pair[1] not in alike(pair[0], rpm=False):
            return pair


def _kind(planted: Sequence[Planted]) -> Kind:
    if any(p.novel for p in planted):
        return "novel"
    return "none" if not planted else "one" if len(planted) == 1 else "two"


def _simulated(case: Case, which: int) -> tuple[Scenario, Simulated]:
    rng = np.random.default_rng([case.seed, 22, which])
    tick_s = STEP_S * case.setup.periods.tick
    time_s = tick_s * np.arange(int(case.seconds[which] / tick_s), dtype=np.float64)
    needs = {planted.needs for planted in case.planted}
    shallow, low = rng.random() < 0.2 or "shallow" in needs, rng.random() < 0.2 or "low" in needs
    depth_m = rng.uniform(0.4, 0.8) if shallow else rng.uniform(2.5, 5.0)
    legs = draw_mission(rng, case.vehicle, case.seconds[which])
    reference = reference_at(legs, time_s, depth_m, rng.uniform(-np.pi, np.pi))
    deepest = float(reference[:, DEPTH].max())
    floor_m = deepest + (rng.uniform(0.15, 0.4) if low else rng.uniform(2.0, 6.0))
    scenario = scenario_of(case.vehicle, len(time_s), case.setup.periods.tick, depth_m, floor_m)
    scenario.sag, scenario.ripple = rng.uniform(0.005, 0.1), rng.uniform(0.0, 0.2)
    for planted in case.planted:
        planted.apply(scenario, rng)
    name = case.name if which == 0 else f"{case.name}-check"
    return scenario, simulate(name, scenario, case.setup, reference, rng)
