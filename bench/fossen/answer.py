"""The result of comparing two runs, in the form of a diagnosis: drift of the simulated velocity, its phases, the
causes.

The fit is of acceleration, by sums of terms of unknown size. It has no newtons, because the runs do not show the
mass.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.fossen.candidates import ALONE
from bench.fossen.evidence import Judged
from bench.fossen.fit import FOLDS, PIECE_S, Pair, Weighed, best_values, folds, learnt, scales
from bench.fossen.runs import STEP_S, Columns, Water, terms, through_water
from identify.diagnose.gap import PHASES, phases_of_motion

Array = NDArray[np.float64]

HORIZON = 50
"""Steps of the reported drift: 5 s."""

STARTED = round(PIECE_S / STEP_S)
"""First step of the windows: the first piece is left out. Runs start at rest over ground in a current, so water from
abeam at no speed ahead occurs there alone, and a model that has not learnt it runs away."""

PARAMETERS = {
    "steady_current": ("north", "east"),
    "dvl_bias": ("x", "y"),
}
"""The values of a candidate that belong to each cause."""

DRAWS, SEED = 400, 0
Z95 = 1.959964

DOFS = ("surge", "sway", "yaw")


def drift(vehicle: str, run: Columns, model: list[Array], flown: Water, starts: NDArray[np.intp]) -> Array:
    """Drift (windows, 3): simulated surge and sway velocity over ground and yaw rate after 5 s, less the recorded ones.

    Each window starts from the recorded state at one of the steps `starts`. The model, sizes (k,) of each state's
    terms, flies `run` in `flown` water; actuators, attitude, heave, roll and pitch are the recorded ones.
    """
    state = np.stack([run[name][starts] for name in "uvr"])

    def rates(at: NDArray[np.intp], nu: Array) -> Array:
        now = {name: values[at] for name, values in run.items()} | dict(zip("uvr", nu, strict=True))
        columns = terms(vehicle, now, flown)
        relative = np.stack([table @ size for table, size in zip(columns, model, strict=True)])
        u, v = through_water(now, flown)
        # A constant current turns in body axes.
        u_water, v_water = now["u"] - u, now["v"] - v
        return np.asarray(relative + np.stack([nu[2] * v_water, -nu[2] * u_water, np.zeros_like(u)]))

    for step in range(HORIZON):
        first = rates(starts + step, state)
        second = rates(starts + step + 1, state + STEP_S * first)
        state = state + 0.5 * STEP_S * (first + second)
    return np.asarray((state - np.stack([run[name][starts + HORIZON] for name in "uvr"])).T)


def answer(judged: Judged) -> dict[str, Any]:
    """The answer in the form of a diagnosis, with the run that holds the cause and all candidates that were tried."""
    pair, found = judged.pair, judged.found
    floor, before, after = _drifts(pair, found)
    before, after = before / floor, after / floor
    return {
        "verdict": judged.verdict,
        "gap": {
            "before": float(np.sqrt(np.mean(before**2))),
            "floor": 1,
            "force": dict.fromkeys(DOFS),
            "acceleration": dict(zip(DOFS, _missing(judged).tolist(), strict=True)),
            "where": _where(pair.other, before),
            "depends_on": _by_heading(pair.other, before),
        },
        "effects": [
            {
                "name": name,
                "also": [],
                "likeness": {},
                "probability": probability,
                "parameters": _parameters(found, name),
                "feedforward_gain": None,
            }
            for name, probability in judged.probabilities.items()
        ],
        "character": None,
        "shrink": {"heldout": None if found.candidate is ALONE else _shrunk(before, after), "check": None},
        "next": None,
        "run": judged.run,
        "tried": {
            weighed.candidate.name: dict(zip(DOFS, weighed.left.tolist(), strict=True))
            for weighed in judged.weighed
        },
    }


def _parameters(found: Weighed, cause: str) -> dict[str, Any]:
    """The parameters of a cause that can be known by themselves; a change of terms has none."""
    return {
        name: {
            "value": float(value),
            "unit": unit,
            "low95": float(value - Z95 * std),
            "high95": float(value + Z95 * std),
        }
        for (name, unit), value, std in zip(found.candidate.units, found.values, found.std, strict=True)
        if name in PARAMETERS.get(cause, ())
    }


def _missing(judged: Judged) -> Array:
    """Rms (3,) of the acceleration that the causes explain on pieces held out, m/s2 and rad/s2."""
    nothing = next(weighed for weighed in judged.weighed if weighed.candidate is ALONE)
    closed = np.maximum(nothing.left**2 - judged.found.left**2, 0.0)
    return np.asarray(np.sqrt(closed) * scales(judged.pair))


def _starts(run: Columns) -> NDArray[np.intp]:
    """The steps at which windows start; the first piece is left out, see STARTED."""
    return np.arange(STARTED, len(run["t"]) - HORIZON, HORIZON // 2)


def _drifts(pair: Pair, found: Weighed) -> tuple[Array, Array, Array]:
    """The floor (3,): drift of the model on the plain run; and the drifts (windows, 3) of the other run without the
    causes and with them. The model and values of each window are learnt without the window's fold."""
    fold, scale, starts = folds(pair.other), scales(pair), _starts(pair.other)
    sizes, _ = learnt(pair, found.candidate, found.values, np.zeros(len(fold), np.bool_))
    plain = drift(pair.vehicle, pair.plain, sizes, Water(), _starts(pair.plain))
    before, after = np.empty((2, len(starts), len(DOFS)))
    for k in range(FOLDS):
        # A window that reaches into another fold must not have learnt its end.
        in_fold = fold[starts] == k
        reached = (starts[in_fold] + HORIZON) // HORIZON
        held = (fold == k) | np.isin(np.arange(len(fold)) // HORIZON, reached)
        values, _ = best_values(pair, found.candidate, found.values, held, scale)
        sizes, changed = learnt(pair, found.candidate, values, held)
        before[in_fold] = drift(pair.vehicle, pair.other, sizes, Water(), starts[in_fold])
        after[in_fold] = drift(
            pair.vehicle, pair.other, changed, found.candidate.water(values), starts[in_fold]
        )
    return np.sqrt(np.mean(plain**2, axis=0)), before, after


def _shrink(before: float, after: float) -> float:
    return (before - after) / (before - 1.0)


def _shrunk(before: Array, after: Array) -> dict[str, float]:
    low, high = _interval(before, after)
    value = _shrink(*(float(np.sqrt(np.mean(drifts**2))) for drifts in (before, after)))
    return {"value": value, "low95": low, "high95": high}


def _interval(before: Array, after: Array) -> tuple[float, float]:
    """95 % interval of the shrink, by drawing pieces of windows with replacement."""
    rng = np.random.default_rng(SEED)
    each = round(2 * PIECE_S / (HORIZON * STEP_S))
    pieces = np.arange(len(before)) // each
    drawn = []
    for _ in range(DRAWS):
        picked = rng.integers(0, pieces[-1] + 1, pieces[-1] + 1)
        rows = np.concatenate([np.flatnonzero(pieces == drifts) for drifts in picked])
        drawn.append(_shrink(*(float(np.sqrt(np.mean(drifts[rows] ** 2))) for drifts in (before, after))))
    low, high = np.percentile(drawn, [2.5, 97.5])
    return float(low), float(high)


def _where(run: Columns, before: Array) -> list[dict[str, Any]]:
    nu = np.column_stack([run[name] for name in "uvwpqr"])
    phases = phases_of_motion(nu, STEP_S)[_starts(run) + HORIZON // 2]
    table = np.stack([np.square(before[phases == k]).sum(axis=0) for k in range(len(PHASES))])
    shares = table / table.sum()
    shares_found = [
        {"dof": dof, "phase": phase, "share": float(shares[k, i])}
        for k, phase in enumerate(PHASES)
        for i, dof in enumerate(DOFS)
        if shares[k, i] > 0
    ]
    return sorted(shares_found, key=lambda one: -float(str(one["share"])))


def _by_heading(run: Columns, before: Array) -> list[dict[str, Any]]:
    """Share of each drift's variance explained by the cosine and sine of the heading."""
    heading = run["psi"][_starts(run) + HORIZON // 2]
    columns = np.column_stack([np.cos(heading), np.sin(heading), np.ones(len(heading))])
    dependences = []
    for dof, off in zip(DOFS, before.T, strict=True):
        left = off - columns @ np.linalg.lstsq(columns, off, rcond=None)[0]
        strength = float(np.clip(1.0 - np.var(left) / np.var(off), 0.0, 1.0))
        dependences.append({"dof": dof, "variable": "heading", "parity": None, "strength": strength})
    return sorted(dependences, key=lambda one: -float(str(one["strength"])))
