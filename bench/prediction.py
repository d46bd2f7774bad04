"""Position error of a prediction after 10 s without measurement, on dives that the parameters were not learnt from."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.answers import NOT_HERE, TITLES, answer, answered, methods
from bench.campaigns import CONFIGURATIONS, dived
from bench.forward import WINDOW_S, moved, run_forward, starts
from bench.missions import Mission
from bench.missions.mission import draw_one
from bench.remembered import Data, Remembered
from bench.stamp import LEARNT, MISSIONS, SIMULATED, stamp
from bench.words import in_a_word, paragraph, table
from bridge.vehicle.coefficients import DAMPINGS, MASSES
from bridge.vehicle.config import VehicleFile
from identify.dive import Dive
from identify.estimators.table import METHODS as PRODUCT

Array = NDArray[np.float64]

SOURCES = (
    *SIMULATED,
    *LEARNT,
    *MISSIONS,
    "bench/prediction.py",
    "bench/forward.py",
    "bench/answers.py",
    "bench/baselines",
    "bench/campaigns.py",
)
HELD_OUT_SEA = 500
"""Added to a campaign's seed: the predicted dive has other water and other noise."""

DRAWN = "drawn vehicles"
FLOOR = "the true parameters"
WHOLE = ", every axis that it states"
COMPARED = ("M_u", "M_v", "I_r", "D_u", "D_v", "D_r")
COMPARED_AXES = np.array([True, True, False, False, False, True])
ANCHOR_CM = 3.3


def page(cache: Path, campaigns: tuple[int, ...], missions: tuple[int, ...]) -> str:
    """The section of docs/benchmarks.md; earlier results are read from `cache`."""
    kept = Remembered(cache / f"prediction-{stamp(*SOURCES)}.jsonl")
    jobs = {
        f"{configuration} {seed}": partial(on_campaign, configuration, seed, cache / "dives", methods())
        for configuration in CONFIGURATIONS
        for seed in campaigns
    }
    jobs |= {f"{DRAWN} {seed}": partial(on_mission, seed, methods()) for seed in missions}
    suffix = " ".join(methods())
    results = kept.fill({f"{key} | {suffix}": job for key, job in jobs.items()}, "prediction")
    return "\n".join(_lines({key.split(" | ")[0]: data for key, data in results.items()}))


def on_campaign(configuration: str, seed: int, folder: Path, names: tuple[str, ...]) -> Data:
    """Learn from the paper's campaign, and predict the validation dive of another day."""
    learnt = dived(configuration, configuration, seed, folder)
    held_out = dived(configuration, "validation", seed + HELD_OUT_SEA, folder)
    models = {name: answered(name, learnt.dive, learnt.file, configuration) for name in names}
    return _errors(
        held_out.dive, held_out.file, configuration, held_out.truth, np.zeros(6), models,
        held_out.time_s, held_out.state[:, :3],
    )  # fmt: skip


def on_mission(seed: int, names: tuple[str, ...]) -> Data:
    """Learn from a benchmark mission, and predict another manoeuvre of the same vehicle."""
    learnt = draw_one(seed)
    held_out = draw_one(seed, repeat=1, kind="double-S" if learnt.kind == "together" else "together")
    models = {name: answered(name, learnt.dive, learnt.file, learnt.configuration) for name in names}
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
        stated_answer = answer(data)
        compared = {key: value for key, value in stated_answer.value.items() if key in COMPARED}
        distances[name] = off({**truth, **compared}, np.where(COMPARED_AXES, stated_answer.trim, trim))
        stated[name] = sum(key in COMPARED for key in truth if key in stated_answer.value)
        if name in PRODUCT:
            distances[name + WHOLE] = off({**truth, **stated_answer.value}, stated_answer.trim)
    return {"off_m": distances, "stated": stated}


def _lines(results: Mapping[str, Data]) -> list[str]:
    windows = {
        group: [data["off_m"] for key, data in results.items() if key.startswith(group)]
        for group in (*CONFIGURATIONS, DRAWN)
    }
    groups = [group for group, dives in windows.items() if dives]
    head = [f"{group}, rms (mean)" for group in groups]
    lines = [
        "## Prediction without measurement",
        "",
        *paragraph(
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
        "",
    ]
    rows = []
    whole = [name + WHOLE for name in methods() if name in PRODUCT]
    for name in (*methods(), *whole, FLOOR):
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
    lines += table(("parameters of", *head, "over the floor", "states"), rows)
    lines += ["", f"{counts}.", "", *_verdict(windows), ""]
    if "pinn" not in PRODUCT:
        lines += [NOT_HERE, ""]
    return lines


def _verdict(windows: Mapping[str, list[dict[str, list[float]]]]) -> list[str]:
    """Means of the paper's vehicle compared with the anchor from the literature, which is a mean."""
    groups = [group for group in CONFIGURATIONS if windows[group]]
    judged = []
    for name in (method for method in methods() if method in PRODUCT):
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
