"""Position error of a prediction after 10 s without measurement, on dives that the parameters were not learnt from."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from bench.accuracy.answers import TITLES, answered
from bench.campaigns import CONFIGURATIONS, dived
from bench.missions.mission import Mission, draw_one
from bench.remembered import Data, Remembered
from bench.stamp import PAPERS_VEHICLE, VEHICLES, reached, stamp
from bench.words import blocks, in_a_word, paragraph, table
from bridge.arrays import Array
from bridge.vehicle.coefficients import DAMPINGS, MASSES
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.dynamics import acceleration, restoring
from identify.dive import Dive
from identify.estimators.table import METHODS as PRODUCT
from identify.ingest.rotation import attitude_at
from identify.thrust.wrench import wrench

STEP_S = 0.02
WINDOW_S = 10.0
REST_M_S = 0.02
RUNAWAY = 20.0
"""m/s or rad/s: a model that reaches this has run away, as a model with negative damping does."""


@dataclass(frozen=True)
class Starts:
    """Measured states at the times `time_s` (n,): `attitude` (n, 4) w x y z, `nu` (n, 6)."""

    time_s: Array
    attitude: Array
    nu: Array

    def __len__(self) -> int:
        return len(self.time_s)


def starts(dive: Dive, file: VehicleFile) -> Starts:
    """A start at a velocity reading every `WINDOW_S`, for windows that end within the dive.

    The velocity is a single DVL reading, carried to the origin by the rates; rates and attitude are interpolated to
    its time. Windows in which the vehicle stays at rest are left out, and after a gap no reading begins two.
    """
    if dive.velocity is None or dive.gyro is None or dive.attitude is None or dive.pwm is None:
        return Starts(np.zeros(0), np.zeros((0, 4)), np.zeros((0, 6)))
    known = np.isfinite(dive.velocity.value).all(axis=1)
    time_s, velocity = dive.velocity.time_s[known], dive.velocity.value[known]
    speed = np.linalg.norm(velocity, axis=1)
    begin = max(float(s.time_s[0]) for s in (dive.velocity, dive.gyro, dive.attitude, dive.pwm))
    chosen: list[int] = []
    for wanted in np.arange(begin, float(time_s[-1]) - WINDOW_S, WINDOW_S):
        first = int(np.searchsorted(time_s, wanted))
        last = int(np.searchsorted(time_s, time_s[first] + WINDOW_S))
        if last < len(time_s) and first not in chosen[-1:] and speed[first:last].mean() > REST_M_S:
            chosen.append(first)
    time_s, velocity = time_s[chosen], velocity[chosen]
    rates = dive.gyro.at(time_s)
    if dive.fog is not None:
        rates[:, 2] = dive.fog.at(time_s)[:, 0]
    dvl = file.vehicle.sensors.dvl
    arm = np.zeros(3) if dvl is None else np.asarray(dvl.mounting.position_m)
    nu = np.column_stack((velocity - np.cross(rates, arm), rates))
    return Starts(time_s, attitude_at(dive.attitude, time_s), nu)


def run_forward(
    begin: Starts,
    dive: Dive,
    file: VehicleFile,
    configuration: str,
    model: Mapping[str, float],
    trim: Array,
) -> Array:
    """NED displacement (n, 3) after `WINDOW_S`, by the commands that the dive recorded and nothing else.

    `model` names all twelve coefficients; `trim` (6,) is a constant wrench in N and N m. NaN in windows in which the
    model runs away. Runge-Kutta of order 4.
    """
    shape = file.vehicle.configurations[configuration]
    mass, damping = ([model[c.name] for c in group] for group in (MASSES, DAMPINGS))
    history = wrench(dive, file, configuration)
    state = np.column_stack((np.zeros((len(begin), 3)), begin.attitude, begin.nu))

    def rate(value: Array, tau: Array) -> Array:
        attitude, nu = value[:, 3:7], value[:, 7:]
        g = restoring(shape, list(attitude.T))
        nu_dot = acceleration(mass, damping, list(nu.T), list((tau + trim).T), g)
        return np.column_stack((earth(attitude, nu[:, :3]), turning(attitude, nu[:, 3:]), *nu_dot))

    steps = round(WINDOW_S / STEP_S)
    for step in range(steps):
        now_s = begin.time_s + step * STEP_S
        before, middle, after = (history.at(now_s + share * STEP_S) for share in (0.0, 0.5, 1.0))
        k1 = rate(state, before)
        k2 = rate(state + 0.5 * STEP_S * k1, middle)
        k3 = rate(state + 0.5 * STEP_S * k2, middle)
        k4 = rate(state + STEP_S * k3, after)
        state = state + STEP_S / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        state[np.abs(state[:, 7:]).max(axis=1) > RUNAWAY] = np.nan
        state[:, 3:7] /= np.linalg.norm(state[:, 3:7], axis=1)[:, None]
    return state[:, :3]


def earth(attitude: Array, vector: Array) -> Array:
    """Body vectors (n, 3) in earth axes, by attitudes (n, 4) w x y z from body to earth."""
    w, axis = attitude[:, :1], attitude[:, 1:]
    across = 2.0 * np.cross(axis, vector)
    turned: Array = vector + w * across + np.cross(axis, across)
    return turned


def turning(attitude: Array, rates: Array) -> Array:
    """Derivative (n, 4) of the attitude (Fossen 2011, eq. 2.68)."""
    w, axis = attitude[:, :1], attitude[:, 1:]
    scalar = -0.5 * np.sum(axis * rates, axis=1, keepdims=True)
    return np.column_stack((scalar, 0.5 * (w * rates + np.cross(axis, rates))))


def moved(time_s: Array, position: Array, begin_s: Array) -> Array:
    """True displacement (n, 3) in the windows, from true positions (m, 3) at the times (m,)."""
    ends = [
        np.column_stack([np.interp(at, time_s, position[:, k]) for k in range(3)])
        for at in (begin_s, begin_s + WINDOW_S)
    ]
    displacement: Array = ends[1] - ends[0]
    return displacement


SOURCES = (reached("bench/accuracy/prediction.py"), *PAPERS_VEHICLE, *VEHICLES)
HELD_OUT_SEA = 500
"""Added to a campaign's seed: the predicted dive has other water and other noise."""

DRAWN = "drawn vehicles"
FLOOR = "the true parameters"
WHOLE = ", every axis that it states"
COMPARED = ("M_u", "M_v", "I_r", "D_u", "D_v", "D_r")
COMPARED_AXES = np.array([True, True, False, False, False, True])
ANCHOR_CM = 3.3


def page(cache: Path, campaigns: tuple[int, ...], missions: tuple[int, ...]) -> str:
    kept = Remembered(cache / f"prediction-{stamp(*SOURCES)}.jsonl")
    jobs = {
        f"{configuration} {seed}": partial(on_campaign, configuration, seed, cache / "dives")
        for configuration in CONFIGURATIONS
        for seed in campaigns
    }
    jobs |= {f"{DRAWN} {seed}": partial(on_mission, seed) for seed in missions}
    return _words_of(kept.fill(jobs, "prediction"))


def on_campaign(configuration: str, seed: int, folder: Path) -> Data:
    """Learn from the paper's campaign, and predict the validation dive of another day."""
    learnt = dived(configuration, configuration, seed, folder)
    held_out = dived(configuration, "validation", seed + HELD_OUT_SEA, folder)
    models = {name: answered(name, learnt.dive, learnt.file, configuration) for name in TITLES}
    return _errors(
        held_out.dive, held_out.file, configuration, held_out.truth, np.zeros(6), models,
        held_out.time_s, held_out.state[:, :3],
    )  # fmt: skip


def on_mission(seed: int) -> Data:
    """Learn from a benchmark mission, and predict another manoeuvre of the same vehicle."""
    learnt = draw_one(seed)
    held_out = draw_one(seed, repeat=1, kind="double-S" if learnt.kind == "together" else "together")
    models = {name: answered(name, learnt.dive, learnt.file, learnt.configuration) for name in TITLES}
    return _errors(
        held_out.dive, held_out.file, held_out.configuration, whole_truth(held_out), held_out.drawn.trim, models,
        held_out.time_s, held_out.position,
    )  # fmt: skip


def whole_truth(mission: Mission) -> dict[str, float]:
    """All twelve coefficients, including those of axes without thrust."""
    values = (*mission.drawn.mass, *mission.drawn.damping)
    return {c.name: float(v) for c, v in zip((*MASSES, *DAMPINGS), values, strict=True)}


def _errors(
    dive: Dive,
    file: VehicleFile,
    configuration: str,
    truth: Mapping[str, float],
    trim: Array,
    models: Mapping[str, Data],
    time_s: Array,
    position: Array,
) -> Data:
    """Distances in m, one per window, by method; coefficients that a method does not state are taken from the truth."""
    begin = starts(dive, file)
    true = moved(time_s, position, begin.time_s)

    def off(model: Mapping[str, float], steady: Array) -> list[float]:
        reached = run_forward(begin, dive, file, configuration, model, steady)
        distance: Array = np.linalg.norm(reached - true, axis=1)
        return [float(d) for d in distance]

    distances = {FLOOR: off(truth, trim)}
    stated = {}
    for name, data in models.items():
        values, steady = data["value"], np.array(data["trim"])
        compared = {key: value for key, value in values.items() if key in COMPARED}
        distances[name] = off({**truth, **compared}, np.where(COMPARED_AXES, steady, trim))
        stated[name] = sum(key in COMPARED for key in truth if key in values)
        if name in PRODUCT:
            distances[name + WHOLE] = off({**truth, **values}, steady)
    return {"off_m": distances, "stated": stated}


def _words_of(results: Mapping[str, Data]) -> str:
    windows = {
        group: [data["off_m"] for key, data in results.items() if key.startswith(group)]
        for group in (*CONFIGURATIONS, DRAWN)
    }
    groups = [group for group, dives in windows.items() if dives]
    head = [f"{group}, rms (mean)" for group in groups]
    rows = []
    whole = [name + WHOLE for name in PRODUCT]
    for name in (*TITLES, *whole, FLOOR):
        of_method = {group: _all(windows[group], name) for group in groups}
        floor = {group: _all(windows[group], FLOOR) for group in groups}
        cells = [_words(of_method[group]) for group in groups]
        kept = {group: np.isfinite(of_method[group]) for group in groups}
        ratio = np.mean(
            [_rms(of_method[group][kept[group]]) / _rms(floor[group][kept[group]]) for group in groups]
        )
        states = [data["stated"].get(name) for data in results.values()]
        number = "-" if states[0] is None else f"{np.mean(states):.1f}"
        rows.append((TITLES.get(name, name), *cells, f"{ratio:.2f}", number))
    counts = ", ".join(
        f"{g}: {len(windows[g])} dives, {len(_all(windows[g], FLOOR))} windows" for g in groups
    )
    return blocks(
        "## Prediction without measurement",
        paragraph(
            f"Distance between predicted and true place after {WINDOW_S:g} s, in cm. Each window begins at one DVL",
            "reading, with the rates and the attitude of that moment; from there on the model knows the recorded",
            "thruster commands alone. Parameters come from the paper's campaign and are tried on the validation dive",
            "in other water; those of the drawn vehicles come from one benchmark mission each and are tried on another",
            "manoeuvre. Each method gives mass, damping and steady force of surge, sway and yaw; heave, roll and pitch",
            "are the truth's for all alike, and so is each of the six coefficients that a method does not state (the",
            "last column: how many it states on average). `every axis that it states`: heave, roll and pitch too are",
            "its own. The last row runs the truth itself: what remains is the disturbance and the noise of the start,",
            "which no method can know, so that its figures are the floor. `over the floor`: rms over the last row's,",
            "the mean of the columns' ratios. `lost`: windows in which the model ran away; they are in no mean.",
        ),
        table(("parameters of", *head, "over the floor", "states"), rows),
        f"{counts}.",
        _verdict(windows),
    )


def _verdict(windows: Mapping[str, list[dict[str, list[float]]]]) -> str:
    """Means of the paper's vehicle compared with the anchor from the literature, which is a mean."""
    groups = [group for group in CONFIGURATIONS if windows[group]]
    judged = []
    for name in PRODUCT:
        means = ", ".join(f"{group} {_mean_cm(windows[group], name):.1f}" for group in groups)
        met = all(_mean_cm(windows[group], name) <= ANCHOR_CM for group in groups)
        judged.append(f"`{name}` {means}: {in_a_word(met)}")
    floor = ", ".join(f"{group} {_mean_cm(windows[group], FLOOR):.1f}" for group in groups)
    below = all(_mean_cm(windows[group], FLOOR) <= ANCHOR_CM for group in groups)
    missed = ": what is missed is due to the disturbance, and to the noise of the start"
    return paragraph(
        f"The anchor from the literature is a mean of {ANCHOR_CM:g} cm after 10 s (Jin, Lyu, Liu and Lu 2025, J. Mar.",
        "Sci. Eng. 13, 2091), of another vehicle in other water: it says what is good, and is no figure side by side.",
        f"Means of the paper's vehicle beside it, in cm: {'; '.join(judged)}. The true parameters themselves come to",
        f"{floor}{'' if below else missed}.",
    )


def _mean_cm(dives: list[dict[str, list[float]]], name: str) -> float:
    return 100 * float(np.nanmean(_all(dives, name)))


def _words(off: Array) -> str:
    lost = int(np.sum(~np.isfinite(off)))
    kept = off[np.isfinite(off)]
    return f"{100 * _rms(kept):.1f} ({100 * kept.mean():.1f})" + (f", {lost} lost" if lost else "")


def _rms(off: Array) -> float:
    return float(np.sqrt(np.mean(off**2)))


def _all(dives: list[dict[str, list[float]]], name: str) -> Array:
    return np.concatenate([np.array(dive[name]) for dive in dives])
