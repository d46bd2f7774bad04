"""A diagnosis as programs read it: by the answers' schema, with no number that does not exist."""

import json
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from fakes.shared import shared

from bridge.vehicle.config import load_vehicle
from identify.challenge.answer import answer_of
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.gap.drift import Drift
from identify.diagnose.remainder.unexplained import GenericForce, Unexplained
from identify.diagnose.result import (
    AxisShrink,
    Character,
    Dependence,
    Diagnosis,
    Disturbance,
    Finding,
    Gain,
    Gap,
    Next,
    Share,
    Shrink,
    Value,
    plain,
)
from identify.diagnose.verdict import (
    above_noise,
    beside_accepted,
    next_for_disturbance,
    next_of,
    share_left,
    unexplained_nats,
    verdict_of,
)
from identify.diagnose.words.diagnosis import shown_note
from identify.effects.library import library

SCHEMA = Path(__file__).resolve().parents[1] / "data" / "answers.schema.json"
FILE = load_vehicle("ruvifist:hovering")
LIBRARY = library(FILE.vehicle.configurations["hovering"], 0.1)
NAN = float("nan")


@pytest.fixture(scope="module")
def schema():
    return json.loads(SCHEMA.read_text())


def test_the_copy_of_the_schema_is_the_shared_one(schema):
    assert schema == json.loads(shared("answers.schema.3.json").read_text())


def effect(name):
    return next(item for item in LIBRARY if item.name == name)


def finding_of(name, **other):
    hidden = effect(name)
    values = {
        key: Value(v, unit, NAN, NAN) for key, (v, unit) in hidden.answer_parameters(hidden.start()).items()
    }
    return replace(Finding(Cause(hidden, hidden.start()), (), {}, 0.9, values, 30.0), **other)


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
        "dive", "ruvifist", "hovering", "explained", gap, (finding_of("quadratic_drag"),), (), None,
        Shrink(2.0, 1.1, 0.9, 0.7, 1.0), None, None, (), 1.0,
    )  # fmt: skip
    return replace(whole, **other)


@pytest.mark.parametrize(
    "made",
    [
        diagnosis(),
        diagnosis(verdict="no_gap", findings=(), heldout=Shrink(1.0, 1.0, NAN, NAN, NAN)),
        diagnosis(
            verdict="ambiguous",
            findings=(finding_of("thruster_lag", also=("command_delay",), likeness={"command_delay": 0.99}),),
            next=Next(("fast steps",), (), ("thruster_lag", "command_delay")),
        ),
        diagnosis(
            verdict="partly",
            findings=(finding_of("weak_thruster", feedforward=Gain(0.02, 0.01)),),
            gap=replace(
                diagnosis().gap,
                unexplained=0.4,
                disturbance=(
                    Disturbance("surge", 1.2, 0.3, True),
                    Disturbance("roll", 0.1, NAN, False, False),
                ),
            ),
            character=Character(("sway",), "world", "neither", "periodic", ("heading",)),
            check=Shrink(
                2.0,
                1.5,
                0.5,
                NAN,
                NAN,
                by_axis=(AxisShrink("surge", 0.03, 0.01, 0.008, 0.9, 0.5, 0.2, NAN),),
            ),
        ),
        diagnosis(verdict="unknown", gap=replace(diagnosis().gap, unexplained=NAN)),
    ],
)
def test_every_verdict_keeps_to_the_schema_and_is_json(made, schema):
    data = plain(made)
    jsonschema.validate(data, schema)
    assert json.loads(json.dumps(data, allow_nan=False)) == data
    assert answer_of(data).verdict == made.verdict


NOTHING = Unexplained((), (), ())
SURE, UNSURE = finding_of("dead_zone"), finding_of("dead_zone", probability=0.4)


def left_by(*gains):
    """Generic forces in surge that save so many nats each."""
    shape = GenericForce(0, "speed", "odd", np.zeros(3))
    return Unexplained(tuple(replace(shape) for _ in gains), gains, tuple(1.0 for _ in gains))


def instead(nats, *gains):
    """Generic forces that save so many nats in place of the causes, and others beside them."""
    return replace(left_by(*gains), instead=nats)


POSSIBLE = replace(UNSURE, also=("thruster_misalignment",))


def disturbed(share, driven):
    return (Disturbance("surge", 3.1, share, driven),)


@pytest.mark.parametrize(
    ("causes", "left", "saved", "closes", "disturbance", "verdict"),
    [
        ((), left_by(), 30.0, 0.9, (), "no_gap"),
        ((SURE,), left_by(), 30.0, 0.9, (), "explained"),
        ((replace(SURE, also=("thrust_curve",)),), left_by(), 30.0, 0.9, (), "ambiguous"),
        # A force within chance is none.
        ((), left_by(5.0), 30.0, 0.9, (), "no_gap"),
        ((SURE,), left_by(5.0), 30.0, 0.9, (), "explained"),
        # Beside something left, causes that are borne out are named in part.
        ((SURE,), left_by(100.0), 1831.0, 0.34, (), "partly"),
        ((SURE,), left_by(100.0), 1831.0, NAN, (), "partly"),
        ((SURE,), left_by(100.0), 1831.0, 0.32, (), "unknown"),
        ((SURE,), left_by(60.0, 50.0), 100.0, 0.8, (), "unknown"),
        ((SURE,), left_by(60.0, 40.0), 100.0, 0.8, (), "partly"),
        ((UNSURE,), left_by(100.0), 1831.0, 0.8, (), "unknown"),
        ((), left_by(100.0), 0.0, NAN, (), "unknown"),
        # Causes in whose place other forces save more are borne out by nothing; by chance, or by a form, they may.
        ((SURE,), instead(325.0), 286.0, 0.9, (), "unknown"),
        ((SURE,), instead(325.0, 20.0), 286.0, 0.9, (), "unknown"),
        # Those that close the gap whole and leave nothing are borne out by that; then others follow a form's remainder.
        ((SURE,), instead(325.0), 286.0, 1.0, (), "explained"),
        ((SURE,), instead(325.0, 20.0), 286.0, 1.0, (), "unknown"),
        ((SURE,), instead(325.0), 286.0, NAN, (), "unknown"),
        ((SURE,), instead(296.0), 286.0, 0.9, (), "explained"),
        ((SURE,), instead(1020.0), 1001.0, 0.9, (), "explained"),
        ((SURE,), instead(286.0, 20.0), 286.0, 0.9, (), "partly"),
        # Causes with which the drift shrinks by nothing at most explain nothing.
        ((SURE,), left_by(), 1831.0, 0.0, (), "unknown"),
        ((SURE,), left_by(), 1831.0, -0.4, (), "unknown"),
        # An error of a reading shrinks no drift, and is explained by that reading.
        ((finding_of("gyro_bias"),), left_by(), 1831.0, 0.0, (), "explained"),
        # A cause that is hardly probable makes no other ambiguous.
        ((SURE, POSSIBLE), left_by(), 1831.0, 0.8, (), "explained"),
        ((POSSIBLE,), left_by(), 10.0, NAN, (), "ambiguous"),
        # A model that leaves a third of the motion to the disturbance is not without a gap.
        ((), left_by(), 0.0, NAN, disturbed(0.5, True), "unknown"),
        ((), left_by(), 0.0, NAN, disturbed(0.3, True), "no_gap"),
        ((), left_by(), 0.0, NAN, disturbed(0.5, False), "no_gap"),
        ((SURE,), left_by(), 30.0, 0.9, disturbed(0.5, True), "explained"),
    ],
)
def test_the_verdict_is_that_of_the_causes_of_what_is_left_and_of_the_disturbance(
    causes, left, saved, closes, disturbance, verdict
):
    assert verdict_of(causes, left, saved, closes, disturbance) == verdict


@pytest.mark.parametrize(("value", "high95", "at_most"), [(0.2, 0.9, 0.9), (0.2, NAN, 0.2), (NAN, NAN, NAN)])
def test_causes_close_at_most_what_the_interval_holds(value, high95, at_most):
    """Beside something left, causes that may close a third of the gap are not called too few."""
    assert Shrink(2.0, 1.8, value, -2.6, high95).at_most == pytest.approx(at_most, nan_ok=True)


def closing(after, value=1.0, axis="surge"):
    """Of pieces held out: an axis drifts by so many floors after the causes."""
    return Shrink(
        2.0, after, value, NAN, NAN, by_axis=(AxisShrink(axis, 0.04, 0.02 * after, 0.02, value, 1, 1, 1),)
    )


SLOW = replace(left_by(100.0), shapes=(GenericForce(0, "speed", "odd", np.zeros(3), "drifting"),))
MISREAD = replace(left_by(100.0), forces=(0.0,))
TILTING = replace(left_by(300.0), shapes=(GenericForce(4, "speed", "odd", np.zeros(3), "transient"),))


@pytest.mark.parametrize(
    ("left", "closes", "filtered", "stays"),
    [
        (left_by(100.0, 50.0), closing(1.2), (), False),
        (left_by(100.0, 50.0), closing(1.3), (), True),
        # Where the causes close little of the gap all stays.
        (left_by(100.0), closing(1.0, NAN), (), True),
        (left_by(100.0), closing(1.0, 0.2), (), True),
        # Behind an autopilot's filter a force without a drift is no unknown where there is no gap.
        (left_by(100.0), closing(1.0, NAN), (0, 1, 2), False),
        (left_by(100.0), closing(1.3, NAN), (0, 1, 2), True),
        (left_by(100.0), closing(1.0, 0.2), (0, 1, 2), True),
        # Elsewhere the floor has grown by it: so it has by one in pitch, which foretells what was held out.
        (TILTING, closing(1.0, NAN, "pitch"), (0, 1, 2), False),
        (TILTING, closing(0.6, NAN, "pitch"), (), True),
        (TILTING, closing(1.0, 0.2, "pitch"), (), True),
        # Far below noise it is the wandering of an estimate, steady or not; in surge it is none.
        (TILTING, closing(0.4, NAN, "pitch"), (), False),
        (replace(TILTING, forces=(1.0,)), closing(0.4, 0.2, "pitch"), (), False),
        (left_by(100.0), closing(0.4, NAN), (), True),
        # The disturbance takes these up, in the floor as in the model.
        (SLOW, closing(1.0), (), True),
        (MISREAD, closing(1.0), (), True),
    ],
)
def test_what_makes_no_drift_beyond_noise_where_the_causes_close_a_gap_is_not_left(
    left, closes, filtered, stays
):
    unexplained = above_noise(left, closes, filtered)
    assert unexplained == left if stays else unexplained.shapes == ()


@pytest.mark.parametrize(
    ("left", "after", "stays"),
    [
        (left_by(100.0), 1.0, False),
        (left_by(100.0), 1.3, True),
        # A force of 1 N is less than the 2 N to which the accepted effects are known.
        (SLOW, 1.0, False),
        (replace(SLOW, forces=(3.0,)), 1.0, True),
        (SLOW, 1.3, True),
        (MISREAD, 1.0, True),
    ],
)
def test_beside_accepted_effects_a_force_that_makes_no_drift_beyond_noise_is_no_unknown(left, after, stays):
    unexplained = above_noise(left, closing(after, NAN), (), np.full(6, 2.0))
    assert unexplained == left if stays else unexplained.shapes == ()


@pytest.mark.parametrize(
    ("left", "inexact", "instead"),
    [
        (left_by(100.0, 50.0), (), 110.0),
        # Chance, and forces of an axis of which none counts in the causes' place, leave it as it is.
        (left_by(9.0), (), 260.0),
        (left_by(100.0), (0,), 260.0),
    ],
)
def test_a_force_that_is_noise_beside_the_causes_is_noise_in_their_place_too(left, inexact, instead):
    """A yaw that a pilot hardly used made a clean field dive unknown, though quadratic drag closed its gap."""
    unexplained = above_noise(replace(left, instead=260.0), closing(1.0), inexact)
    assert (unexplained.shapes, unexplained.instead) == ((), instead)


def test_a_slow_force_counts_in_no_causes_place_and_takes_nothing_from_it():
    """Beside accepted effects a small one is left out."""
    left = replace(SLOW, instead=260.0)
    assert above_noise(left, closing(1.0, NAN), (), np.full(6, 2.0)) == replace(left_by(), instead=260.0)


def test_beside_accepted_effects_a_slow_wander_of_roll_or_pitch_is_no_unknown_however_large():
    wandering = replace(SLOW, shapes=(GenericForce(3, "time", None, np.zeros(3), "drifting"),), forces=(9.0,))
    assert above_noise(wandering, closing(1.0, NAN, "roll"), ()) == wandering
    assert above_noise(wandering, closing(1.0, NAN, "roll"), (), np.full(6, 2.0)).shapes == ()
    assert above_noise(wandering, closing(1.3, NAN, "roll"), (), np.full(6, 2.0)) == wandering


def test_beside_accepted_effects_a_wander_of_an_estimated_heading_is_no_unknown_and_one_of_another_is():
    wandering = replace(SLOW, shapes=(GenericForce(5, "time", None, np.zeros(3), "drifting"),), forces=(9.0,))
    estimated = np.array([2.0, 2.0, 2.0, np.inf, np.inf, np.inf])
    assert above_noise(wandering, closing(1.0, NAN, "yaw"), (), estimated).shapes == ()
    assert above_noise(wandering, closing(1.0, NAN, "yaw"), (), np.full(6, 2.0)) == wandering


def test_causes_beside_accepted_effects_only_show_where_they_open_no_gap():
    causes = (finding_of("dead_zone"), finding_of("weak_thruster"))
    assert beside_accepted(causes, closing(1.0, NAN)) == ((), causes)
    assert beside_accepted(causes, closing(1.0, 0.8)) == (causes, ())
    (sentence,) = shown_note(causes)
    assert "dead zone (90 %) and weak thruster" in sentence
    assert " show, but open no gap" in sentence
    (alone,) = shown_note(causes[:1])
    assert "dead zone (90 %) shows, but opens no gap" in alone
    assert shown_note(()) == ()


def test_only_forces_beyond_chance_count_as_left():
    assert unexplained_nats(left_by(100.0, 50.0, 5.0)) == 150.0
    assert unexplained_nats(NOTHING) == 0.0


def test_what_is_left_is_a_share_of_the_gap_where_something_is_left():
    assert share_left("explained", 0.7) == share_left("no_gap", NAN) == 0.0
    assert share_left("partly", 0.7) == pytest.approx(0.3)
    assert (share_left("partly", 1.2), share_left("unknown", -0.3)) == (0.0, 1.0)
    assert np.isnan(share_left("unknown", NAN))


def test_a_large_disturbance_is_looked_at_on_one_spot_and_with_the_thrusters_off():
    alone = next_for_disturbance(None)
    assert "thrusters off" in alone.manoeuvres[0]
    assert "current" in alone.sensors[0]
    both = next_for_disturbance(Next(("fast steps",), (), ("thruster_lag",)))
    assert both.manoeuvres == (*alone.manoeuvres, "fast steps")
    assert both.splits == ("thruster_lag",)


def test_what_to_dive_next_is_what_tells_apart_the_causes_that_are_alike():
    more = next_of([finding_of("battery_sag", also=("fouling",))], LIBRARY)
    assert more.splits == ("battery_sag", "fouling")
    assert "a coast-down" in more.manoeuvres
    assert "the voltage" in more.sensors
    assert next_of([finding_of("battery_sag")], LIBRARY) is None
