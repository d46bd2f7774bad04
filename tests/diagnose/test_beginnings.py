"""Causes that begin within a dive: planted by their own form, and by a simulator that shares no equation with it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from fakes.planted import diagnosed, explained
from soak import rows_rest_in_soak

from bridge.vehicle.thrusters import allocation_matrix
from identify.challenge.case import draw_case
from identify.challenge.planted_effects import Planted
from identify.challenge.scenario import LAG, NOTHING, PULSE, no_force
from identify.challenge.vehicles import LAG_S
from identify.diagnose.accepted import _effect, none_accepted
from identify.diagnose.causes import onset
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.causes.confidence import without_doubtful
from identify.diagnose.causes.onset import _Residual, unsought, with_beginnings
from identify.diagnose.causes.shafts import Search
from identify.diagnose.causes.weighing import weighing_of
from identify.diagnose.diagnose import is_earlier
from identify.diagnose.filters.nominal import refitted
from identify.diagnose.result import Finding, plain_effect
from identify.diagnose.shrink.check_dive import recurring
from identify.diagnose.words.causes import name_of
from identify.effects.actuators import weak
from identify.effects.effect import beginning
from identify.effects.hydrodynamics import QUADRATIC_DRAG
from identify.effects.rigid_body import NET_BUOYANCY

TENTH = np.array([0.1])
LIBRARY = (weak(1), weak(2), NET_BUOYANCY)


def with_cause(nominal, effect, values):
    """The dive with the act of an effect taken from what moved it, so that the effect explains the rest."""
    course = nominal.course
    act = effect.act(course, values)
    return replace(refitted(nominal, [act.times(-1.0)]), acts=(), course=course)


def searched(nominal, *library):
    return Search(nominal, *without_doubtful(explained(nominal, *library), nominal, library))


@pytest.fixture(scope="module")
def broken(nominal):
    """A dive whose recording began at 5 s, and in which thruster 2 gives a tenth of its thrust from 70 s on."""
    return with_cause(nominal, beginning(weak(2), 70.0, 5.0), TENTH)


def test_an_effect_that_begins_in_a_dive_acts_from_then_on_and_all_the_next_dive(nominal):
    course = nominal.course
    later = beginning(weak(2), 70.0, 5.0)
    whole, part = (effect.act(course, TENTH).wrench for effect in (weak(2), later))
    after = course.time_s >= 75.0
    assert not part[~after].any()
    assert np.array_equal(part[after], whole[after])
    cause = Cause(later, TENTH).throughout
    assert np.array_equal(cause.act(course).wrench, whole)
    assert (cause.effect.label, later.label) == (
        "weak_thruster of thruster 2",
        "weak_thruster of thruster 2 since 70 s",
    )


def test_a_thruster_that_breaks_in_a_dive_is_named_with_when_and_how_much(broken):
    search = searched(broken, *LIBRARY)
    begun = with_beginnings(search, LIBRARY, 5.0)
    (cause,) = begun.explanation.causes
    assert cause.key == ("weak_thruster", 2)
    assert cause.effect.since_s == pytest.approx(70.0, abs=1.5)
    assert cause.values[0] == pytest.approx(0.1, abs=0.1)


def test_a_stretch_saves_what_its_column_does_once_the_known_ones_are_taken_out_and_nothing_new_saves_nothing(
    broken,
):
    weighing = weighing_of(broken, LIBRARY)
    fit = weighing.fitted([Cause(weak(1), np.array([0.9]))])
    residual, course = _Residual.of(weighing, fit, fit, 5.0), broken.course
    act, stretch = Cause(weak(2), TENTH).act(course), (np.intp(3000), np.intp(5000))
    index = np.arange(len(course.time_s))
    within = (index >= stretch[0]) & (index < stretch[1])
    column = weighing.rows.columns([act.each(lambda part: within[:, None] * part)], course)
    beyond = (column - residual.known.times(residual.free @ residual.known.crossed(column)))[:, 0]
    nats, best = residual._best([stretch], act)
    assert best == stretch
    assert nats == pytest.approx(0.5 * (residual.left @ beyond) ** 2 / (beyond @ beyond))
    known_already, _ = residual._best([(np.intp(0), np.intp(len(index)))], fit.causes[0].act(course))
    assert known_already < 0.1


def test_a_thruster_that_was_weak_all_along_has_no_beginning(nominal):
    search = searched(with_cause(nominal, weak(2), TENTH), *LIBRARY)
    assert [cause.effect.label for cause in search.explanation.causes] == [weak(2).label]
    assert with_beginnings(search, LIBRARY, 5.0) is search


def test_a_round_that_finds_no_new_beginning_is_the_last_and_one_that_does_has_another(
    nominal, broken, monkeypatch
):
    before, steady = searched(broken), searched(with_cause(nominal, weak(2), TENTH), *LIBRARY)
    since = (Cause(beginning(weak(2), 70.0, 5.0), TENTH),)
    explanation = steady.explanation
    begun = replace(steady, explanation=replace(explanation, fit=replace(explanation.fit, causes=since)))
    for first, rounds in ((steady, 1), (begun, 2)):
        left = [first, before]
        monkeypatch.setattr(onset, "_with_more", lambda *_, left=left: left.pop(0))
        with_beginnings(before, LIBRARY, 5.0)
        assert len(left) == 2 - rounds


def test_a_dive_too_short_for_beginnings_says_that_none_was_looked_for():
    short, long = (SimpleNamespace(since_s=np.array([0.0, last_s])) for last_s in (40.0, 60.0))
    assert unsought(short, LIBRARY) == (
        "Causes that begin within the dive were not looked for: it lasts 40 s, and that takes 60 s or more.",
    )
    assert unsought(long, LIBRARY) == unsought(short, (QUADRATIC_DRAG,)) == ()


def test_a_short_dive_with_a_gap_says_so_beside_its_verdict():
    diagnosis = diagnosed(draw_case(300_051, names=["quadratic_drag"], size=0.9, seconds=45.0))
    assert diagnosis.verdict != "no_gap"
    assert diagnosis.provisos[-1].startswith("Causes that begin within the dive were not looked for")


def test_drag_never_begins_in_a_dive(broken):
    search = searched(broken, QUADRATIC_DRAG)
    assert with_beginnings(search, (QUADRATIC_DRAG,), 5.0) is search


def test_the_answer_says_since_when_and_what_is_accepted_holds_from_the_start():
    finding = Finding(Cause(beginning(weak(2), 70.0, 5.0), TENTH), (), {}, 0.9, {}, 100.0)
    assert plain_effect(finding)["since_s"] == 70.0
    assert name_of(finding) == "weak thruster 2 from about 70 s on"
    assert _effect(finding).label == weak(2).label
    assert "since_s" not in plain_effect(replace(finding, cause=Cause(weak(2), TENTH)))


def test_what_acts_in_the_last_seconds_alone_is_no_change_of_the_vehicle(nominal):
    """A hull that surfaces, or hangs on a hook."""
    end_s = float(nominal.course.time_s[-1])
    lifted = with_cause(nominal, beginning(NET_BUOYANCY, end_s - 10.0, 0.0), np.array([-20.0]))
    begun = with_beginnings(searched(lifted, *LIBRARY), LIBRARY, 0.0)
    assert all(cause.effect.since_s <= end_s - 20.0 for cause in begun.explanation.causes)
    earlier = with_cause(nominal, beginning(NET_BUOYANCY, end_s - 40.0, 0.0), np.array([-20.0]))
    (cause,) = with_beginnings(searched(earlier, *LIBRARY), LIBRARY, 0.0).explanation.causes
    assert (cause.effect.name, cause.values[0]) == ("net_buoyancy", pytest.approx(-20.0, abs=1.0))
    assert cause.effect.since_s == pytest.approx(end_s - 40.0, abs=1.5)


def test_what_broke_in_a_dive_was_sound_in_the_one_before():
    broke, weak_all_along = Cause(beginning(weak(2), 70.0, 5.0), TENTH), Cause(weak(1), TENTH)
    earlier, later = (recurring((broke, weak_all_along), is_earlier=earlier) for earlier in (True, False))
    assert earlier == [weak_all_along]
    assert later == [broke.throughout, weak_all_along]


def test_a_check_is_earlier_where_both_clocks_say_so():
    def dived(unix_at_boot_s):
        return SimpleNamespace(unix_at_boot_s=unix_at_boot_s, span_s=(1.0, 9.0))

    assert is_earlier(dived(100.0), dived(200.0))
    assert not is_earlier(dived(200.0), dived(100.0))
    assert not is_earlier(dived(None), dived(200.0))
    assert not is_earlier(dived(100.0), dived(None))


def test_an_effect_that_ended_acts_in_its_stretch_alone_and_is_none_of_the_vehicles_any_more(nominal):
    course = nominal.course
    over = beginning(weak(2), 40.0, 5.0, 70.0)
    whole, part = (effect.act(course, TENTH).wrench for effect in (weak(2), over))
    within = (course.time_s >= 45.0) & (course.time_s < 75.0)
    assert not part[~within].any()
    assert np.array_equal(part[within], whole[within])
    assert over.label == "weak_thruster of thruster 2 from 40 to 70 s"
    assert (over.lasting, beginning(weak(2), 40.0, 5.0).lasting) == (False, True)
    assert recurring((Cause(over, TENTH),), is_earlier=False) == []
    finding = Finding(Cause(over, TENTH), (), {}, 0.9, {}, 100.0)
    assert name_of(finding) == "weak thruster 2 from about 40 to 70 s"
    assert (plain_effect(finding)["since_s"], plain_effect(finding)["until_s"]) == (40.0, 70.0)
    assert none_accepted((finding,)).startswith(
        "what was found is over, and so not accepted: weak thruster 2 from"
    )


def test_a_begun_effect_that_goes_on_tells_no_end():
    assert "until_s" not in plain_effect(
        Finding(Cause(beginning(weak(2), 70.0, 5.0), TENTH), (), {}, 0.9, {}, 1.0)
    )


def test_an_effect_that_passes_within_a_dive_is_named_with_its_beginning_and_its_end(nominal):
    passed = with_cause(nominal, beginning(NET_BUOYANCY, 40.0, 0.0, 75.0), np.array([6.0]))
    (cause,) = with_beginnings(searched(passed, *LIBRARY), LIBRARY, 0.0).explanation.causes
    assert cause.effect.name == "net_buoyancy"
    assert (cause.effect.since_s, cause.effect.until_s) == (
        pytest.approx(40.0, abs=2.0),
        pytest.approx(75.0, abs=2.0),
    )
    assert cause.values[0] == pytest.approx(6.0, rel=0.1)


def test_a_thruster_that_is_weak_for_a_while_is_named_with_that_while_though_the_filters_hide_it(nominal):
    hurt = with_cause(nominal, beginning(weak(2), 30.0, 0.0, 75.0), np.array([0.22]))
    (cause,) = with_beginnings(searched(hurt, *LIBRARY), LIBRARY, 0.0).explanation.causes
    assert cause.key == ("weak_thruster", 2)
    assert (cause.effect.since_s, cause.effect.until_s) == (
        pytest.approx(30.0, abs=1.0),
        pytest.approx(75.0, abs=1.0),
    )
    assert cause.values[0] == pytest.approx(0.22, abs=0.1)


def broken_case(seed, thruster, gain, seconds, from_s=0.0, to_s=0.0):
    """A dive of the sealed dives' simulator, in the middle of which a thruster begins to give less than it is asked
    for; or from and to these times."""
    case = draw_case(seed, kind="none", seconds=seconds)
    lost = (gain - 1.0) * allocation_matrix(case.vehicle.configuration)[:, thruster - 1]

    def apply(scenario, _rng):
        scenario.drawn = no_force()._replace(
            size=lost,
            signal=np.array([PULSE + thruster - 1, NOTHING]),
            when=(
                (scenario.time_s >= from_s) & (scenario.time_s < to_s)
                if to_s
                else scenario.time_s >= 0.5 * scenario.time_s[-1]
            ).astype(float),
            memory=LAG,
            memory_s=LAG_S,
        )

    return replace(case, planted=(Planted("weak_thruster", {}, apply, 1.0, novel=True),))


@pytest.mark.parametrize(
    ("seed", "thruster", "gain", "seconds"),
    rows_rest_in_soak(
        [
            (389_104, 3, 0.44, 160.0),
            (389_100, 4, 0.68, 400.0),
            (389_101, 2, 0.52, 400.0),
            (389_103, 5, 0.33, 400.0),
            (389_106, 4, 0.64, 400.0),
        ],
        keep=1,
    ),
)
def test_a_thruster_that_breaks_in_a_dive_made_by_other_equations_is_named_alone_with_when_and_how_much(
    seed, thruster, gain, seconds
):
    case = broken_case(seed, thruster, gain, seconds)
    diagnosis = diagnosed(case)
    (finding,) = diagnosis.findings
    assert (diagnosis.verdict, finding.cause.key) == ("explained", ("weak_thruster", thruster))
    assert finding.cause.effect.since_s == pytest.approx(0.5 * seconds, abs=3.0)
    told = finding.parameters["gain"]
    assert told.low95 < gain < told.high95 < 0.9


def lighter_case(seed, force_n, since_s, seconds, until_s=np.inf):
    """A dive of the sealed dives' simulator, from `since_s` to `until_s` of which a force pulls the vehicle up."""
    case = draw_case(seed, kind="none", seconds=seconds)

    def apply(scenario, _rng):
        scenario.drawn = no_force()._replace(
            size=np.array([0.0, 0.0, -force_n, 0.0, 0.0, 0.0]),
            when=((scenario.time_s >= since_s) & (scenario.time_s < until_s)).astype(float),
        )

    return replace(case, planted=(Planted("net_buoyancy", {}, apply, 1.0, novel=True),))


@pytest.mark.parametrize(
    ("seed", "force_n", "since_s", "seconds"),
    [
        # The filters without it take it for a disturbance, and give it back in many turns.
        (300_100, 15.0, 45.0, 120.0),
        # They hide it whole until they are fitted with it.
        (300_112, -5.7, 46.0, 100.0),
    ],
)
def test_a_weight_that_changes_in_a_short_dive_is_found_with_its_size(seed, force_n, since_s, seconds):
    diagnosis = diagnosed(lighter_case(seed, force_n, since_s, seconds))
    (finding,) = diagnosis.findings
    assert (diagnosis.verdict, finding.name) == ("explained", "net_buoyancy")
    assert finding.cause.effect.since_s == pytest.approx(since_s, abs=1.0)
    assert finding.parameters["force"].value == pytest.approx(force_n, rel=0.03)


def test_a_pull_that_passes_in_a_dive_made_by_other_equations_is_told_with_its_end_and_is_not_accepted():
    diagnosis = diagnosed(lighter_case(300_200, 8.0, 50.0, 160.0, until_s=90.0))
    (finding,) = diagnosis.findings
    effect = finding.cause.effect
    assert (diagnosis.verdict, finding.name) == ("explained", "net_buoyancy")
    assert (effect.since_s, effect.until_s) == (pytest.approx(50.0, abs=1.0), pytest.approx(90.0, abs=1.0))
    assert finding.parameters["force"].value == pytest.approx(8.0, rel=0.03)
    assert diagnosis.accepted.effects == ()
    assert "Net buoyancy from about 50 to 90 s is over, and is not accepted." in diagnosis.accepted.sentences


@pytest.mark.soak
def test_a_thruster_that_is_weak_for_a_while_is_not_taken_for_one_that_is_weak_all_along():
    """At the noise levels that take it for that, its own stretch saves too little to stand in its place."""
    case = broken_case(300_221, 2, 0.2226375969512226, 300.0, 68.33688807855182, 167.54140171167774)
    (finding,) = diagnosed(case).findings
    effect = finding.cause.effect
    assert finding.cause.key == ("weak_thruster", 2)
    assert (effect.since_s, effect.until_s) == (pytest.approx(68.3, abs=1.0), pytest.approx(167.5, abs=1.0))
    assert finding.parameters["gain"].value == pytest.approx(0.223, abs=0.03)
