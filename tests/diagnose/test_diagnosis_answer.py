"""A diagnosis as programs read it: by the answers' schema, with no number that does not exist."""

import json
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from bridge.effects.library import library
from bridge.vehicle.config import load_vehicle
from identify.challenge.answers import answer_of
from identify.diagnose.answer import plain
from identify.diagnose.candidates import Cause
from identify.diagnose.drift import Drift
from identify.diagnose.result import (
    Character,
    Dependence,
    Diagnosis,
    Found,
    Gain,
    Gap,
    Next,
    Share,
    Shrink,
    Value,
)
from identify.diagnose.unexplained import GenericForce, Unexplained
from identify.diagnose.verdict import next_of, verdict_of

SCHEMA = Path(__file__).resolve().parents[2].parent / "shared" / "answers.schema.json"
FILE = load_vehicle("ruvifist:hovering")
LIBRARY = library(FILE.vehicle.configurations["hovering"], 0.1)
NAN = float("nan")


@pytest.fixture(scope="module")
def schema():
    if not SCHEMA.is_file():
        pytest.skip("no shared data beside the checkout")
    return json.loads(SCHEMA.read_text())


def effect(name):
    return next(one for one in LIBRARY if one.name == name)


def found(name, **other):
    one = effect(name)
    values = {key: Value(v, unit, NAN, NAN) for key, (v, unit) in one.told(one.start()).items()}
    return replace(Found(Cause(one, one.start()), (), {}, 0.9, values, 30.0), **other)


def diagnosis(**other):
    drift = Drift(5.0, np.arange(3.0), np.ones((3, 6)), np.ones(6))
    gap = Gap(
        2.1,
        (drift,),
        (drift,),
        {"surge": 1.5, "roll": NAN},
        (Share("surge", "steady", 0.7), Share("yaw", "turning", 0.3)),
        (),
        (Dependence("surge", "speed", "odd", 0.9), Dependence("yaw", "heading", None, 0.2)),
    )
    whole = Diagnosis(
        "dive", "ruvifist", "hovering", "explained", gap, (found("quadratic_drag"),), (), None,
        Shrink(2.0, 1.1, 0.9, 0.7, 1.0), None, None, (), 1.0,
    )  # fmt: skip
    return replace(whole, **other)


@pytest.mark.parametrize(
    "made",
    [
        diagnosis(),
        diagnosis(verdict="no_gap", found=(), heldout=Shrink(1.0, 1.0, NAN, NAN, NAN)),
        diagnosis(
            verdict="ambiguous",
            found=(found("thruster_lag", also=("command_delay",), likeness={"command_delay": 0.99}),),
            next=Next("fast steps", "", ("thruster_lag", "command_delay")),
        ),
        diagnosis(
            verdict="unknown",
            character=Character(("sway",), "world", "neither", "periodic", ("heading",)),
            check=Shrink(2.0, NAN, NAN, NAN, NAN),
        ),
        diagnosis(found=(found("weak_thruster", feedforward=Gain(0.02, 0.01)),)),
    ],
)
def test_every_verdict_keeps_to_the_schema_and_is_json(made, schema):
    data = plain(made)
    jsonschema.validate(data, schema)
    assert json.loads(json.dumps(data, allow_nan=False)) == data
    assert answer_of(data).verdict == made.verdict


def test_parameters_of_every_effect_are_those_that_the_schema_lists_for_it(schema):
    listed = schema["$defs"]["parameters_of_each_effect"]
    for one in LIBRARY:
        assert set(one.told(one.start())) <= set(listed[one.name]), one.label


def test_the_judge_of_challenges_reads_the_same_numbers():
    judged = answer_of(plain(diagnosis(check=Shrink(2.0, 1.5, 0.5, NAN, NAN))))
    assert judged.first_dof == "surge"
    assert (judged.predicted, judged.measured) == (0.9, 0.5)
    assert judged.named[0].parameters["X_uu"][0] == 10.0


NOTHING = Unexplained((), (), ())
MUCH = Unexplained((GenericForce(0, "speed", "odd", np.zeros(3)),), (1e4,), (1.0,))


@pytest.mark.parametrize(
    ("causes", "left", "verdict"),
    [
        ((), NOTHING, "no_gap"),
        ((found("dead_zone"),), NOTHING, "explained"),
        ((found("dead_zone", also=("thrust_curve",)),), NOTHING, "ambiguous"),
        ((), MUCH, "unknown"),
        ((found("dead_zone"),), MUCH, "unknown"),
    ],
)
def test_the_verdict_follows_from_causes_and_from_what_is_left(causes, left, verdict):
    assert verdict_of(causes, left) == verdict


def test_what_to_dive_next_is_what_tells_apart_the_causes_that_are_alike():
    more = next_of([found("battery_sag", also=("fouling",))], LIBRARY)
    assert more is not None
    assert more.splits == ("battery_sag", "fouling")
    assert "coast-down" in more.manoeuvre
    assert "voltage" in more.sensor
    assert next_of([found("battery_sag")], LIBRARY) is None
