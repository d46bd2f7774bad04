"""A drawn force planted in a dive, at its drawn size, and unlike any known effect.

Its size is the drift over 5 s that the force causes beyond the part that a refit of the nominal model takes up,
over the drift by noise alone of the same dive without it. Drift and floor are measured as by the diagnosis itself
(`identify/diagnose/gap/drift.py`), in the degree of freedom with the largest ratio.
"""

from dataclasses import dataclass, replace

import numpy as np

from bench.diagnosis.trials import recorded_dive
from bench.unknown.grammar import Sentence, draw_sentence, force_of
from bridge.arrays import Array
from bridge.vehicle.thrusters import allocation_matrix, thrust_curve
from identify.challenge.case import Case, draw_case
from identify.challenge.nearest_parameters import EACH_S, course_of, missing_wrench, nominal_columns
from identify.challenge.scenario import DEPTH, Planted, Scenario, signal_of
from identify.challenge.simulate import Simulated
from identify.diagnose.causes.candidates import settings_of
from identify.diagnose.filters.regression import LEVELLED
from identify.diagnose.gap.drift import EVERY_S, HORIZONS_S, floors_of
from identify.diagnose.gap.measured import FIVE_S
from identify.diagnose.gap.simulation import Simulation, simulation_of
from identify.diagnose.nominal_fit import fitted_nominal
from identify.effects.course import Course
from identify.effects.effect import Act, Effect
from identify.effects.environment import varying_current, waves
from identify.effects.library import library

MULTIPLES = (1.5, 6.0)
NEAR, ROUNDS = 0.1, 7
"""Largest relative deviation from the wanted multiple, and the number of trials to reach it."""

LEAST_LEFT = 0.2
"""Share of a force's power that a refit has to leave; below it, the force is a change of mass or damping."""

MOST_LIKE = 0.8
"""Largest share of the remainder that one known effect may explain; above it, the force is that effect."""

LEAST_SCALE = 1e-6
SEAS_S = 200.0


@dataclass(frozen=True)
class Unknown:
    """A case with one drawn force, its sentence, and its drift in floors."""

    case: Case
    sentence: Sentence
    multiple: float


@dataclass(frozen=True)
class _Still:
    """A dive without the force: the nominal model along it, and the floors (6,) of its drift over 5 s."""

    case: Case
    simulated: Simulated
    model: Simulation
    floor: Array

    def multiple(self, force: Array, time_s: Array, dofs: tuple[int, ...]) -> float:
        """Drift of a force (n, 6) at times (n,), in floors."""
        model = self.model
        lacking = np.column_stack([np.interp(model.time_s, time_s, column) for column in force.T])
        lacking[:, [dof for dof in range(6) if dof not in model.dofs]] = 0.0
        every = round(EVERY_S / model.step_s)
        steps = round(HORIZONS_S[FIVE_S] / model.step_s)
        starts = np.arange(0, len(model.time_s) - steps - 1, every)
        off = replace(model, lacking=lacking).off(starts, [steps], np.zeros_like(model.nu))[:, 0]
        caused = np.sqrt(np.mean(off**2, axis=0)) / self.floor
        return float(max((caused[dof] for dof in dofs if dof in model.dofs), default=np.nan))


def unknown_of(seed: int) -> Unknown:
    """The case of a seed: vehicle, mission and sensors of `draw_case`, and a force that is no known effect."""
    still = _without(draw_case(seed, name=f"unknown {seed}", kind="none"))
    thrusters = len(still.case.vehicle.configuration.thrusters)
    redrawn = 0
    while True:
        rng = np.random.default_rng([seed, 40, redrawn])
        sentence = draw_sentence(rng, thrusters)
        sized = _sized(still, sentence, float(rng.uniform(*MULTIPLES)))
        if sized is not None:
            case, multiple = sized
            return Unknown(case, sentence, multiple)
        redrawn += 1


def _without(case: Case) -> _Still:
    _, simulated = case.simulated(0)
    nominal = fitted_nominal(recorded_dive(case), case.file, case.configuration)
    model = simulation_of(nominal, nominal.theta, nominal.motion.nu)
    floors = floors_of(nominal, model, np.random.default_rng(case.seed))
    return _Still(case, simulated, model, floors[FIVE_S])


def _sized(still: _Still, sentence: Sentence, wanted: float) -> tuple[Case, float] | None:
    """Scale the force to the wanted drift, and return the case and the drift in floors.

    Returns None if a signal hardly moves, the size is not found, a refit takes the force up, or it is a known effect.
    """
    typical = [typical_of(still.case, still.simulated, factor.signal) for factor in sentence.factors]
    if any(scale < LEAST_SCALE for _, scale in typical):
        return None
    middle, scale = (np.array(part) for part in zip(*typical, strict=True)) if typical else (np.zeros(0),) * 2
    size = 0.3 * still.case.vehicle.share
    for _ in range(ROUNDS):
        case = replace(still.case, planted=(planted(sentence, size, middle, scale),))
        scenario, simulated = case.simulated(0)
        if not np.isfinite(simulated.ticks.state).all():
            return None
        whole, left = left_of(scenario, simulated)
        assert simulated.dive.pwm is not None
        multiple = still.multiple(left, simulated.dive.pwm.time_s, sentence.dofs)
        if not np.isfinite(multiple) or multiple <= 0:
            return None
        if abs(multiple / wanted - 1.0) < NEAR:
            std = scenario.vehicle.disturbance
            kept = np.sum((left / std) ** 2) / np.sum((whole / std) ** 2)
            known = float(kept) < LEAST_LEFT or likeness(scenario, simulated, sentence.period_s) > MOST_LIKE
            return None if known else (case, multiple)
        size *= float(np.clip(wanted / multiple, 0.1, 10.0))
    return None


def planted(sentence: Sentence, size: float, middle: Array, scale: Array) -> Planted:
    """The force at a size, in a dive of any length."""

    def apply(scenario: Scenario, _: np.random.Generator) -> None:
        force = force_of(sentence, scenario.time_s, middle, scale)
        scenario.drawn = force._replace(size=size * force.size)

    return Planted("drawn_force", {}, apply, size, novel=True)


def typical_of(case: Case, simulated: Simulated, signal: int) -> tuple[float, float]:
    """Centre of a signal in a dive (mean of a depth, zero for others), and its rms about it."""
    ticks, vehicle = simulated.ticks, case.vehicle
    asked = thrust_curve(vehicle.file.vehicle.thrust_curve, vehicle.file.path.parent).thrust(ticks.pwm)
    thrust = ticks.nominal @ allocation_matrix(vehicle.configuration).T
    values = np.array(
        [
            signal_of(signal, state, rate, wrench, pulse)
            for state, rate, wrench, pulse in zip(
                ticks.state[::5], ticks.nu_dot[::5], thrust[::5], asked[::5], strict=True
            )
        ]
    )
    middle = float(values.mean()) if signal == DEPTH else 0.0
    return middle, float(np.sqrt(np.mean((values - middle) ** 2)))


def model_columns(nu: Array, nu_dot: Array) -> Array:
    """Wrench for a unit of each parameter of the diagnosis' nominal model, (n, 6, 14): total masses, dampings, and
    trims in roll and pitch, where a tilted sensor looks like a steady moment."""
    trims = np.zeros((len(nu), 6, len(LEVELLED)))
    trims[:, LEVELLED, range(len(LEVELLED))] = 1.0
    return np.concatenate([nominal_columns(nu, nu_dot), trims], axis=2)


def left_of(scenario: Scenario, simulated: Simulated) -> tuple[Array, Array]:
    """The planted wrench in a dive, and the part that a refit of the nominal model leaves, (n, 6) each at the ticks."""
    missing, std = missing_wrench(scenario, simulated), scenario.vehicle.disturbance
    columns = model_columns(simulated.ticks.state[:, 7:13], simulated.ticks.nu_dot)
    table = (columns / std[None, :, None]).reshape(-1, columns.shape[2])
    theta = np.linalg.lstsq(table, (missing / std).reshape(-1), rcond=None)[0]
    return missing, missing - columns @ theta


def likeness(scenario: Scenario, simulated: Simulated, period_s: float) -> float:
    """Largest share of the power of a refit's remainder that one known effect explains.

    Each degree of freedom is scaled by its disturbance. An error of a reading counts as the force that the model
    would see in it. A force with a period is also compared with waves and currents of that period.
    """
    course, std = course_of(scenario, simulated), scenario.vehicle.disturbance
    every = max(round(EACH_S / course.step_s), 1)
    effects: tuple[Effect, ...] = library(course.configuration, course.lag_s)
    effects = tuple(setting for setting in effects if setting.parameters and not setting.refit_absorbs)
    if 0 < period_s < SEAS_S:
        effects += (waves(period_s), varying_current(period_s))
    settings, causes = settings_of(effects, course)
    forces = (_force(cause.act(course), course) for cause in causes)
    table = np.column_stack([(force[::every] / std).reshape(-1) for force in forces])
    nominal = model_columns(course.nu[::every], course.nu_dot[::every]) / std[None, :, None]
    base = np.linalg.svd(nominal.reshape(-1, nominal.shape[2]), full_matrices=False)[0]
    assert simulated.dive.pwm is not None
    at_s, missing = simulated.dive.pwm.time_s, missing_wrench(scenario, simulated) / std
    whole = np.column_stack([np.interp(course.time_s[::every], at_s, column) for column in missing.T])
    value = whole.reshape(-1) - base @ (base.T @ whole.reshape(-1))
    table -= base @ (base.T @ table)
    power = float(value @ value)
    shares = [_share(table[:, list(setting.columns)], value) / power for setting in settings]
    return max(shares)


def _share(columns: Array, value: Array) -> float:
    """The power of a value that columns explain."""
    size = np.sqrt((columns**2).sum(axis=0))
    scaled = columns[:, size > 0] / size[size > 0]
    if not scaled.shape[1]:
        return 0.0
    fitted = scaled @ np.linalg.lstsq(scaled, value, rcond=1e-9)[0]
    return float(fitted @ fitted)


def _force(act: Act, course: Course) -> Array:
    """An act's wrench (n, 6), plus the force that the model sees in the act's wrong velocities."""
    out = np.zeros_like(course.nu)
    if act.wrench is not None:
        out += act.wrench
    for part, place in ((act.velocity, slice(0, 3)), (act.gyro, slice(3, 6))):
        if part is not None:
            rate = np.gradient(part, course.step_s, axis=0)
            out[:, place] += course.mass[place] * rate + course.damping[place] * part
    return out
