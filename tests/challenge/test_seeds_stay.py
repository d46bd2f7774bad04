"""The dive of a seed stays the same, whatever is rebuilt: sealed dives are given out by seeds, figures rest on them.

`SEATRIAL_KEEP_DIVES=1 pytest` of this file keeps them anew, after a change that is meant to make other dives.
"""

import json
import os
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from identify.challenge.case import check_of, dive_of, draw_case
from identify.challenge.novel_effects import NOVEL
from identify.challenge.planted_effects import PLANTS
from identify.challenge.scenario import scenario_of
from identify.dive import Signal

KEPT = Path(__file__).resolve().parents[1] / "data" / "planted_dives.json"
SEED, SECONDS = 391_600, 40.0
NAMES = [*PLANTS, *NOVEL]


def in_a_number(values):
    """One number that changes with each value, its sign and its place."""
    flat = np.nan_to_num(np.asarray(values, dtype=float).ravel(), posinf=0.0, neginf=0.0)
    return (
        float(np.mean(np.linspace(1.0, 2.0, len(flat)) * (np.abs(flat) + 0.3 * flat))) if len(flat) else 0.0
    )


def signals_of(dive):
    """Each signal of a dive in a number."""
    named = {field.name: getattr(dive, field.name) for field in fields(dive)}
    return {name: in_a_number(s.value) for name, s in named.items() if isinstance(s, Signal)}


def planted_dive(number):
    """What is planted in a dive of an effect, and the dive."""
    case = draw_case(SEED + number, names=[NAMES[number]], seconds=SECONDS)
    _, simulated = case.simulated(0)
    truth = case.truth()
    (effect,) = truth["effects"]
    return {
        "vehicle": truth["vehicle"],
        "parameters": effect["parameters"],
        "sizes": truth["size_by_dof"],
        "nominal": truth["nominal"],
        "dof": truth["dof"],
        "moved": dict(zip("uvwpqr", map(in_a_number, simulated.ticks.state.T[7:13]), strict=True)),
        "signals": signals_of(dive_of(case)),
    }


def drawn_case(seed):
    """What hides in a case of which nothing is asked for, and how its check dive goes."""
    case = draw_case(seed, seconds=SECONDS)
    return {
        "kind": case.kind,
        "vehicle": case.configuration,
        "planted": [planted.name for planted in case.planted],
        "without": [planted.name for planted in draw_case(seed, kind="novel", without=["fouling"]).planted],
        "lasts": dict(zip(("dive", "check"), draw_case(seed).seconds, strict=True)),
        "signals": signals_of(check_of(case)),
    }


def as_kept(made):
    return json.loads(json.dumps(made), parse_float=lambda number: float(f"{float(number):.7g}"))


def judged(key, made):
    if os.environ.get("SEATRIAL_KEEP_DIVES"):
        kept = json.loads(KEPT.read_text()) if KEPT.exists() else {}
        KEPT.write_text(json.dumps(kept | {key: as_kept(made)}, indent=0, sort_keys=True) + "\n")
    kept = json.loads(KEPT.read_text())[key]
    assert made.keys() == kept.keys()
    for name, value in kept.items():
        if isinstance(value, dict):
            value = pytest.approx(value, rel=1e-4, abs=1e-9)
        assert made[name] == value, name


@pytest.mark.parametrize("number", range(len(NAMES)), ids=NAMES)
def test_a_seed_plants_its_effect_in_the_same_dive_as_ever(number):
    judged(NAMES[number], planted_dive(number))


@pytest.mark.parametrize("name", ["sticking_thruster", "knocks", "ballast_pump"])
def test_a_seed_s_unknown_effect_comes_and_goes_as_ever_in_ten_minutes(name):
    """In a short dive it may not come at all."""
    vehicle, rng = draw_case(SEED, names=[]).vehicle, np.random.default_rng(SEED)
    made = {}
    for size in (0.0, 1.0):
        scenario = scenario_of(vehicle, 7_800, 10, 3.0, 9.0)
        NOVEL[name](rng, vehicle, size).apply(scenario, rng)
        pushes = dict(zip("XYZKMN", map(in_a_number, scenario.push.T), strict=True))
        made[f"{size:g}"] = pushes | {"stuck": in_a_number(scenario.prop.stuck_when)}
    judged(f"{name} in ten minutes", made)


@pytest.mark.parametrize("seed", range(SEED, SEED + 12))
def test_a_seed_draws_the_same_case_as_ever(seed):
    judged(str(seed), drawn_case(seed))
