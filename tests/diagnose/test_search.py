"""Causes that were put in by hand are found by name, with their size, and nothing else is."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from fakes.planted import explained
from soak import rest_in_soak

from bridge.vehicle.coefficients import PITCH
from bridge.vehicle.config import Configuration, Thruster
from identify.diagnose import findings
from identify.diagnose.causes import ambiguity, confidence, ranking, search, selection
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.causes.form_remainder import FormRemainder
from identify.diagnose.causes.requirement import least_gain, required_gain, sought_nats
from identify.diagnose.causes.search import explained_by
from identify.diagnose.causes.selection import pruned, with_one_more
from identify.diagnose.causes.weighing import Fitted, weighing_of
from identify.diagnose.filters.nominal import refitted
from identify.diagnose.findings import probability
from identify.effects.actuators import COMMAND_DELAY, DEAD_ZONE, thruster_lag, weak
from identify.effects.effect import Act
from identify.effects.environment import STEADY_CURRENT, waves
from identify.effects.hydrodynamics import COUPLED_DAMPING, QUADRATIC_DRAG
from identify.effects.library import library
from identify.effects.rigid_body import PITCH_ROLL_COUPLING
from identify.effects.sensors import DEPTH_SCALE, DVL_SCALE

LIBRARY = (COUPLED_DAMPING, STEADY_CURRENT, DEAD_ZONE, QUADRATIC_DRAG)


def test_an_axis_that_no_thruster_pushes_has_no_say_on_when_thrust_acts(nominal):
    """Coriolis forces made anew were worth 40 nats in pitch, and a delay of 82 ms that saved 20 elsewhere was lost."""
    still = replace(
        nominal, built=replace(nominal.built, unpushed={PITCH: "the thrusters never pushed in pitch"})
    )
    problems = tuple(
        replace(problem, axis=replace(problem.axis, force=3.0 * problem.axis.force))
        if problem.axis.dof == PITCH
        else problem
        for problem in nominal.joint.problems
    )
    joint = replace(nominal.joint, problems=problems)
    lost = nominal.joint.log_likelihood(nominal.theta) - joint.log_likelihood(nominal.theta)
    other = replace(still, joint=joint, log_posterior=nominal.log_posterior - lost)
    assert abs(lost) > 10.0
    assert search._by_pushed(other) == pytest.approx(search._by_pushed(still), abs=1e-3)
    pushed = replace(nominal, built=replace(nominal.built, unpushed={}))
    assert search._by_pushed(pushed) == nominal.log_posterior


def test_a_dive_that_obeys_the_nominal_model_has_no_cause(nominal):
    assert explained(nominal, *LIBRARY).causes == ()


def test_a_drag_of_which_the_model_is_told_the_opposite_is_found_with_its_size(nominal):
    """A model that takes a drag for a push: to it the vehicle has that drag more."""
    size = (
        0.3
        * nominal.course.damping[0]
        / np.abs(nominal.course.nu[:, 0]).max()
        * np.array([5.0, 0, 0, 0, 0, 0])
    )
    opposed = refitted(nominal, [QUADRATIC_DRAG.act(nominal.course, -size)])
    spoilt = replace(opposed, acts=(), course=nominal.course)
    explanation = explained(spoilt, *LIBRARY)
    (cause,) = explanation.causes
    assert cause.effect is QUADRATIC_DRAG
    assert cause.values[0] == pytest.approx(size[0], rel=0.15)
    assert explanation.now.course.mass[0] == pytest.approx(nominal.course.mass[0], rel=0.02)


def test_a_cause_whose_size_ends_at_nothing_is_gone(nominal):
    weighing = weighing_of(nominal, LIBRARY)
    (left,) = weighing.fitted([Cause(QUADRATIC_DRAG, np.array([0.0, 0, 0, 0, 0, 1e-6]))]).causes or (None,)
    assert left is None or left.values[5] > 0
    assert weighing.fitted([Cause(DEAD_ZONE, DEAD_ZONE.none())]).causes == ()


def test_the_form_of_a_cause_asks_more_of_a_further_one_only_where_both_show(nominal):
    weighing = weighing_of(nominal, LIBRARY)
    drag, turning, slowing = (
        Cause(QUADRATIC_DRAG, size * np.eye(6)[dof]) for size, dof in ((5000, 0), (500, 5), (2000, 0))
    )
    fit = replace(weighing.fitted(()), causes=(drag,), motion_nats=1e9)
    remainder = FormRemainder(weighing, fit)
    itself = remainder.overlap(drag)
    for size in (1.0, 1e-6):
        other = Cause(QUADRATIC_DRAG, size * slowing.values)
        assert remainder.overlap(other) == pytest.approx(itself)
    assert remainder.overlap(turning) < 0.05 * itself
    assert remainder.overlap(turning) == FormRemainder(weighing, fit).overlap(turning)


def with_drag(nominal, bent=None):
    """The dive with a surge drag of which the model is told the opposite, and the drag as it was put in."""
    course = nominal.course
    size = 1.5 * course.damping[0] / np.abs(course.nu[:, 0]).max() * np.eye(6)[0]
    planted = replace(QUADRATIC_DRAG.act(course, -size), quadratic=None)
    planted = planted if bent is None else planted.each(bent)
    return replace(refitted(nominal, [planted]), acts=(), course=course), Cause(QUADRATIC_DRAG, size)


@pytest.fixture(scope="module")
def draggy(nominal):
    """That dive and its drag; no test changes either."""
    return with_drag(nominal)


@pytest.fixture(scope="module")
def explained_drag(draggy):
    """What explains that dive."""
    return explained(draggy[0], *LIBRARY)


def test_a_cause_whose_form_is_true_asks_little_of_a_further_one(nominal):
    """By what its other forms save, or a thousandth of its own: they save something of a drag that comes late."""
    even = replace(
        QUADRATIC_DRAG, name="even", act=lambda course, by: Act(wrench=by * np.sqrt(np.abs(course.nu)))
    )
    further = Cause(even, np.eye(6)[0])
    seen = []
    for bent in (None, lambda part: np.roll(part, 10, axis=0)):
        spoilt, drag = with_drag(nominal, bent)
        weighing = weighing_of(spoilt, LIBRARY)
        fit = replace(weighing.fitted([drag]), motion_nats=1e5, unsteady_nats=1e5)
        remainder = FormRemainder(weighing, fit)
        large = Cause(QUADRATIC_DRAG, 100 * fit.causes[0].values)
        many = FormRemainder(weighing, replace(fit, causes=(large,)))
        assert many.overlap(further) == pytest.approx(1e4 * remainder.overlap(further))
        assert many.saved_overlap(further) < 0.01 * many.overlap(further)
        asked = max(many.saved_overlap(further), 0.001 * 1e5)
        assert required_gain(many, further) == pytest.approx(7.0 + asked)
        seen.append(remainder.saved_overlap(further))
    assert seen[1] > 5 * seen[0]


def fitted(causes, nats):
    """A fit that saves so many nats, and shows in the motion."""
    shows = 100.0 * len(causes)
    return Fitted(
        tuple(causes), (), np.zeros(1), np.zeros((1, 0)), np.zeros((0, 0)), 1.0, nats, 1.0, shows, shows
    )


def saving(nats):
    """Stands in for a weighing in which any cause saves so many nats, and none saves nothing."""
    return SimpleNamespace(
        fitted=lambda causes: fitted(causes, nats if causes else 0.0),
        candidates_beyond_forms=lambda *_: None,
        now=SimpleNamespace(stamped_s=0.0, course=None),
    )


PUSH = Cause(QUADRATIC_DRAG, 50.0 * np.eye(6)[0])


@pytest.mark.parametrize(
    ("nats", "errors", "saved", "taken"),
    [(7.1, 1.1, 7.1, True), (7.0, 50.0, 90.0, False), (7.1, 1.0, 90.0, False), (7.1, 1.1, 7.0, False)],
)
def test_a_cause_is_taken_from_seven_nats_and_one_standard_error_of_them_on(
    monkeypatch, nats, errors, saved, taken
):
    """By the equations of all candidates, and `saved` by the fit with it."""
    monkeypatch.setattr(selection, "beyond_all", lambda *_: None)
    monkeypatch.setattr(selection, "ranked_candidates", lambda *_: [(nats, errors, PUSH)])
    fit = with_one_more(saving(saved), fitted((), 0.0))
    assert fit.causes == ((PUSH,) if taken else ())


def test_of_an_effect_four_sizes_are_weighed_the_best_of_them_first():
    settings = [ranking.Setting(effect, (k,), np.eye(1)) for k, effect in enumerate([DEAD_ZONE] * 6)]
    settings.insert(2, ranking.Setting(STEADY_CURRENT, (9,), np.eye(1)))
    kept = [setting.columns[0] for setting in ranking._few_of_each(settings)]
    assert kept == [0, 1, 9, 2, 3]


@pytest.mark.parametrize(
    ("sizes", "kept"),
    [
        ((3.0, 1.6, 9.0), [(0, 1, 2)]),
        ((3.0, 1.4, 9.0), [(0, 1, 2), (0, 2)]),
        ((1.4, 1.3, -1.2), [(0, 1, 2), (0,)]),
    ],
)
def test_numbers_of_a_cause_within_one_and_a_half_of_their_errors_are_left_out_but_for_one(sizes, kept):
    asked = []

    def evidence(columns):
        asked.append(tuple(columns))
        size = 0.5 * np.array([sizes[column] for column in columns])
        return SimpleNamespace(size=size, covariance=0.25 * np.eye(len(columns)))

    candidates = SimpleNamespace(equations=SimpleNamespace(evidence=evidence))
    _, columns = ranking.weighed_setting(candidates, ranking.Setting(QUADRATIC_DRAG, (0, 1, 2), np.eye(3)))
    assert (asked, columns) == (kept, kept[-1])


@pytest.mark.parametrize(("nats", "kept"), [(7.0, True), (6.9, False)])
def test_a_cause_alone_that_saves_less_than_seven_nats_is_dropped_again(nats, kept):
    assert pruned(saving(nats), fitted([PUSH], nats)).causes == ((PUSH,) if kept else ())


@pytest.mark.parametrize(
    ("nats", "errors", "kept"), [(7.0, 1.1, True), (6.9, 1.1, False), (20.0, 1.0, False)]
)
def test_a_cause_beside_another_is_dropped_where_it_saves_less_than_is_asked_or_one_standard_error(
    monkeypatch, nats, errors, kept
):
    coupled = Cause(COUPLED_DAMPING, np.array([1.0, -1.0]))
    monkeypatch.setattr(
        selection, "_others_at_their_best", lambda _, fit, k: fitted([fit.causes[1 - k]], 20.0)
    )
    monkeypatch.setattr(selection, "required_gain", lambda *_: 7.0)
    monkeypatch.setattr(
        selection, "ranked_candidates", lambda *_: [(nats, errors, PUSH), (20.0, 5.0, coupled)]
    )
    left = pruned(saving(20.0), fitted([PUSH, coupled], 40.0)).causes
    assert left == ((PUSH, coupled) if kept else (coupled,))


@pytest.mark.parametrize(("first", "looks"), [(1, [0, 1, 2]), (2, [0, 2, 1])])
def test_of_two_sets_of_causes_that_lead_to_each_other_the_smaller_is_told(draggy, monkeypatch, first, looks):
    spoilt, drag = draggy
    coupled, asked = Cause(COUPLED_DAMPING, np.array([1.0, -1.0])), []

    def restless(weighing, fit, _refused):
        asked.append(len(fit.causes))
        return weighing.fitted((drag, coupled)[: {0: first, 1: 2, 2: 1}[len(fit.causes)]])

    monkeypatch.setattr(search, "improved", restless)
    assert [cause.effect for cause in explained(spoilt, *LIBRARY).causes] == [QUADRATIC_DRAG]
    assert asked == looks


@pytest.mark.parametrize(("fallen", "taken"), [(0.0, False), (20.0, True)])
def test_a_cause_that_lowers_the_likelihood_is_taken_only_where_the_filters_without_it_fall_as_low_by_themselves(
    draggy, monkeypatch, fallen, taken
):
    spoilt, drag = draggy
    settled, asked = search._settled, []

    def lasting(_, weighing, fit):
        return weighing.now.log_posterior - (0.0 if fit.causes else fallen)

    def less_likely(nominal, weighing, fit, at):
        weighing, fit = settled(nominal, weighing, fit, at)
        worse = replace(weighing.now, log_posterior=spoilt.log_posterior - 10.0)
        return replace(weighing, now=worse), fit

    def eager(weighing, fit, refused):
        asked.append(set(refused))
        return fit if drag.effect.label in refused else weighing.fitted([drag])

    monkeypatch.setattr(search, "_settled", less_likely)
    monkeypatch.setattr(search, "_lasting", lasting)
    monkeypatch.setattr(search, "improved", eager)
    causes = explained(spoilt, *LIBRARY).causes
    assert [cause.effect for cause in causes] == [drag.effect] * taken
    assert asked == [set(), set() if taken else {drag.effect.label}]


def test_a_search_that_finds_other_causes_each_time_ends_after_ten_turns(monkeypatch):
    weighing, asked, told = replace_now(saving(20.0), log_posterior=0.0), [], []

    def restless(*_):
        asked.append(Cause(weak(len(asked) + 1), np.array([0.5])))
        return fitted(asked[-1:], 20.0)

    monkeypatch.setattr(search, "improved", restless)
    monkeypatch.setattr(search, "_settled", lambda _, weighing, fit, __: (weighing, fit))
    for step in ("timing", "variants"):
        monkeypatch.setattr(search, f"_with_likeliest_{step}", lambda _, weighing, fit, __: (weighing, fit))
    monkeypatch.setattr(search, "_with_usual_values", lambda _, weighing, fit, __: (weighing, fit))
    found = search._searched(None, None, weighing, fitted([], 0.0), lambda share, _: told.append(share))
    assert (len(asked), found.causes) == (10, (asked[-1],))
    assert told == sorted(told)
    assert (told[0], told[-1]) == pytest.approx((0.5 / 11, 10 / 11))


def test_a_search_ends_where_the_same_causes_in_another_form_lower_the_likelihood(draggy, monkeypatch):
    spoilt, drag = draggy
    other = Cause(drag.effect, drag.values + np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0]))
    settled, forms = search._settled, [drag, other, drag]

    def less_likely(nominal, weighing, fit, at):
        weighing, fit_now = settled(nominal, weighing, fit, at)
        if not forms[0].values[1]:
            fit_now, worse = fit, replace(weighing.now, log_posterior=-1e9)
            weighing = replace(weighing, now=worse)
        return weighing, fit_now

    monkeypatch.setattr(search, "_settled", less_likely)
    monkeypatch.setattr(search, "improved", lambda weighing, *_: weighing.fitted([forms.pop(0)]))
    explanation = explained(spoilt, *LIBRARY)
    assert len(forms) == 1
    assert explanation.causes[0].values[1] == 0.0
    assert explanation.now.log_posterior > -1e9


def test_causes_are_refitted_no_further_than_the_likelihood_of_the_filters_grows(draggy, monkeypatch):
    spoilt, drag = draggy
    made = []

    def less_and_less_likely(*given):
        made.append(replace(refitted(*given), log_posterior=-100.0 * len(made)))
        return made[-1]

    monkeypatch.setattr(search, "refitted", less_and_less_likely)
    assert explained_by([drag], spoilt, LIBRARY).now is made[0]
    assert len(made) == 2


def test_in_waves_and_there_alone_the_tilting_of_the_hull_tells_no_mass(nominal):
    """Its Munk moments are those of speeds through the water, and a mass of theirs was 22 % off."""
    swell, drag = Cause(waves(5.0), np.full(6, 2.0)), Cause(QUADRATIC_DRAG, np.full(6, 5.0))
    assert explained_by([swell, drag], nominal, (swell.effect, *LIBRARY)).now.joint.in_waves
    assert not explained_by([drag], nominal, LIBRARY).now.joint.in_waves
    heavier, unmoved = nominal.theta.copy(), {}
    heavier[nominal.joint.mass_indices[0]] += 1.0
    for in_waves in (False, True):
        joint = replace(nominal.joint, in_waves=in_waves)
        masses = {p.axis.dof: float(p.masses[0]) for p in joint.at(heavier)}
        unmoved[in_waves] = {dof for dof, mass in masses.items() if mass == masses[0]}
        for k, problem in enumerate(joint.problems):
            size = joint.slices[k].stop - joint.slices[k].start
            others = len(joint.score_of(k, nominal.theta)[0]) - size
            assert (others == 0) is (in_waves and problem.axis.dof in (3, 4))
    assert unmoved[False] - unmoved[True] == {3, 4}


def test_causes_are_refitted_from_the_filters_that_are_near(draggy, monkeypatch):
    """From filters without any, whose masses make up for the causes, the climb may end far lower."""
    spoilt, drag = draggy
    starts = []

    def refitted_from(begun, acts, near):
        starts.append(near)
        return refitted(begun, acts, near)

    monkeypatch.setattr(search, "refitted", refitted_from)
    near = explained_by([drag], spoilt, LIBRARY).now
    assert starts[0] is spoilt
    starts.clear()
    explained_by([drag], spoilt, LIBRARY, near)
    assert starts[0] is near


@pytest.mark.parametrize(
    ("nats", "errors", "rise", "saved", "taken"),
    [
        (8.0, 5.1, 60.1, 90.0, True),
        (8.0, 5.1, 59.9, 90.0, False),
        (8.0, 4.9, 60.1, 90.0, False),
        (8.0, 5.1, 20.1, 100.1, True),
        (10.1, 1.1, 20.1, 100.1, True),
        (10.1, 0.9, 20.1, 100.1, False),
        (10.1, 1.1, 19.9, 100.1, False),
        (10.1, 1.1, 59.9, 99.9, False),
        (6.9, 50.0, 90.0, 90.0, False),
    ],
)
def test_a_further_cause_that_saves_too_little_is_taken_if_the_filters_are_far_likelier_with_it(
    monkeypatch, nats, errors, rise, saved, taken
):
    """Filters without it took it for other masses, or for a disturbance; the remainder of another cause's form, which
    grows no further, is none."""
    first, late = Cause(COUPLED_DAMPING, np.array([1.0, -1.0])), Cause(COMMAND_DELAY, np.array([0.001]))
    monkeypatch.setattr(search, "beyond_all", lambda *_: None)
    monkeypatch.setattr(search, "FormRemainder", lambda *_: None)
    monkeypatch.setattr(search, "required_gain", lambda *_: 20.0)
    # A delay within the error of the stamps is no cause, and hides none behind it.
    monkeypatch.setattr(search, "may_be_cause", lambda cause, _: cause.effect is not COMMAND_DELAY)
    monkeypatch.setattr(search, "ranked_candidates", lambda *_: [(90.0, 9.0, late), (nats, errors, PUSH)])
    settled = replace_now(saving(50.0), log_posterior=rise)
    monkeypatch.setattr(search, "_settled", lambda *given: (settled, replace(given[2], gain=50.0 + saved)))
    monkeypatch.setattr(search, "_lasting", lambda _, weighing, __: weighing.now.log_posterior)
    weighing = replace_now(saving(8.0), log_posterior=0.0)
    fit = search._likelier_with_one_more(None, weighing, fitted([first], 50.0), (), None)
    assert (fit is not None) == taken
    assert fit is None or fit[1].causes == (first, PUSH)
    refused = (PUSH.effect.label,)
    assert search._likelier_with_one_more(None, weighing, fitted([first], 50.0), refused, None) is None


def test_a_further_cause_that_the_filters_drop_is_none_and_neither_are_the_others_then(monkeypatch):
    first = Cause(COUPLED_DAMPING, np.array([1.0, -1.0]))
    monkeypatch.setattr(search, "beyond_all", lambda *_: None)
    monkeypatch.setattr(search, "FormRemainder", lambda *_: None)
    monkeypatch.setattr(search, "required_gain", lambda *_: 20.0)
    monkeypatch.setattr(search, "may_be_cause", lambda *_: True)
    monkeypatch.setattr(search, "ranked_candidates", lambda *_: [(12.0, 9.0, PUSH)])
    monkeypatch.setattr(search, "_lasting", lambda *_: 0.0)
    weighing = replace_now(saving(8.0), log_posterior=0.0)
    for left in ((first,), ()):
        monkeypatch.setattr(search, "_settled", lambda *_, left=left: (weighing, fitted(left, 90.0)))
        assert search._likelier_with_one_more(None, weighing, fitted([first], 50.0), (), None) is None


@pytest.mark.parametrize(
    ("least_likely", "climb", "turns"),
    [(10.5, 0.01, 1), (9.5, 0.01, 5), (-np.inf, 6.9, 5), (-np.inf, 7.0, 20)],
)
def test_causes_are_settled_in_five_turns_or_twenty_while_the_filters_rise_and_not_where_these_are_far_less_likely(
    monkeypatch, least_likely, climb, turns
):
    """At another maximum they climb a little with every turn, and never to where they were."""
    weighing, refits = saving(8.0), []
    monkeypatch.setattr(search, "_same", lambda *_: False)
    monkeypatch.setattr(search, "replace", lambda what, **_: what)

    def refitted(*_):
        refits.append(replace_now(weighing, log_posterior=10.0 + climb * len(refits)).now)
        return refits[-1]

    monkeypatch.setattr(search, "refitted", refitted)
    nominal = SimpleNamespace(joint=None)
    at = lambda now, _: SimpleNamespace(fitted=weighing.fitted, now=now)  # noqa: E731
    settled, _ = search._settled(nominal, weighing, fitted([], 50.0), at, least_likely)
    assert (len(refits), settled.now) == (turns, refits[-1])


def replace_now(weighing, log_posterior):
    """Such a weighing, by filters of that posterior."""
    now = SimpleNamespace(**vars(weighing.now), log_posterior=log_posterior)
    return SimpleNamespace(**{**vars(weighing), "now": now})


def test_a_doubtful_cause_is_as_probable_as_the_filters_need_it(draggy, explained_drag, monkeypatch):
    (spoilt, _), explanation = draggy, explained_drag
    without = explained_by([], spoilt, LIBRARY, explanation.now)
    rises = explanation.now.log_posterior - without.now.log_posterior
    by_filters = ambiguity.margin_by_filters(explanation, 0, spoilt, LIBRARY)
    assert 7.0 < by_filters <= rises
    monkeypatch.setattr(findings, "feedforward_gain", lambda *_: None)
    nothing = ambiguity.AmbiguityGroup((), {}, 0.0)
    monkeypatch.setattr(findings, "ambiguity_of", lambda *_: nothing)
    (cause,) = findings.findings_of(explanation, explanation.fit.covariance, None, 0.0, spoilt, LIBRARY)
    assert cause.probability == pytest.approx(probability(by_filters))


def findings_beside(explanation, unexplained_nats):
    """The causes beside unknown forces, as probable as the regression holds them."""
    return findings.findings_of(
        explanation, explanation.fit.covariance, None, unexplained_nats, explanation.now, ()
    )


@pytest.mark.parametrize(
    ("effect", "log_posterior", "also"),
    [(DEPTH_SCALE, 98.0, ("dvl_scale",)), (DEPTH_SCALE, 96.0, ()), (DEAD_ZONE, 98.0, ())],
    ids=["as likely", "less likely", "another cause"],
)
def test_a_dvl_that_reads_large_is_another_name_for_a_depth_that_reads_small(
    monkeypatch, effect, log_posterior, also
):
    """Depth beside the speed up and down tells the ratio of both scales alone."""
    given = []

    def explained_by(causes, _nominal, _library, near):
        given.extend(causes)
        # A lower maximum lies near the filters with the other cause.
        return SimpleNamespace(now=SimpleNamespace(log_posterior=log_posterior - 9.0 * (near is not None)))

    monkeypatch.setattr(ambiguity, "explained_by", explained_by)
    causes = (Cause(effect, np.array([0.8])),)
    explanation = SimpleNamespace(causes=causes, now=SimpleNamespace(log_posterior=100.0))
    assert ambiguity.absorbed_instead(explanation, 0, None, (effect, DVL_SCALE)) == also
    assert [(cause.effect, cause.values.tolist()) for cause in given] == (
        2 * [(DVL_SCALE, [1.25])] if effect is DEPTH_SCALE else []
    )


def test_what_the_forms_of_other_causes_may_leave_makes_a_cause_no_more_probable(explained_drag, monkeypatch):
    monkeypatch.setattr(findings, "feedforward_gain", lambda *_: None)
    monkeypatch.setattr(findings, "margin_by_filters", lambda *_: 0.0)
    (certain,) = findings_beside(explained_drag, 0.0)
    monkeypatch.setattr(ambiguity, "remainder_nats", lambda *_: certain.gain_nats - 6.0)
    (doubtful,) = findings_beside(explained_drag, 0.0)
    assert doubtful.probability < 0.6 < certain.probability


def test_beside_an_unknown_force_a_margin_counts_by_its_share_of_both(explained_drag, monkeypatch):
    monkeypatch.setattr(findings, "feedforward_gain", lambda *_: None)
    monkeypatch.setattr(findings, "margin_by_filters", lambda *_: 0.0)
    causes = [findings_beside(explained_drag, nats)[0] for nats in (0.0, 40.0, 1e9)]
    margins = [6.0 * cause.probability / (0.98 - cause.probability) for cause in causes]
    assert margins[1] == pytest.approx(margins[0] ** 2 / (margins[0] + 10.0))
    assert causes[1].probability > 0.8 * causes[0].probability
    assert causes[2].probability < 0.01


@pytest.mark.parametrize(
    ("margin_nats", "expected"), [(-1.0, 0.0), (0.0, 0.0), (3.0, 0.98 / 3), (6.0, 0.49), (54.0, 0.98 * 0.9)]
)
def test_six_nats_are_worth_half_of_the_most_that_is_ever_told(margin_nats, expected):
    assert probability(margin_nats) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(("log_posterior", "named"), [(-2.9, 1), (-3.0, 2)])
def test_of_two_thrusters_that_do_as_well_the_weak_one_is_named(monkeypatch, log_posterior, named):
    strong, weaker = Cause(weak(2), np.array([1.4])), Cause(weak(1), np.array([0.7]))
    instead = SimpleNamespace(now=SimpleNamespace(log_posterior=log_posterior))
    weighing = SimpleNamespace(
        now=SimpleNamespace(log_posterior=0.0),
        fitted=lambda causes: SimpleNamespace(causes=causes),
        candidates_with_fit=lambda _: None,
    )
    monkeypatch.setattr(search, "ranked_candidates", lambda *_: [(9.0, 9.0, strong), (8.0, 8.0, weaker)])
    monkeypatch.setattr(search, "_settled", lambda *given: (instead, given[2]))
    _, fit = search._with_usual_values(None, weighing, weighing.fitted((strong,)), None)
    assert [cause.effect.number for cause in fit.causes] == [named]


@pytest.mark.parametrize("planted", rest_in_soak(range(3)), ids=["delay", "first order", "two stages"])
def test_a_late_thrust_is_named_by_the_form_with_which_the_filters_are_likeliest(nominal, planted):
    forms = (COMMAND_DELAY, *thruster_lag(nominal.course.lag_s))
    causes = [Cause(form, form.none() + 0.2) for form in forms]
    opposed = refitted(nominal, [causes[planted].act(nominal.course).times(-1.0)])
    late = replace(opposed, acts=(), course=nominal.course)
    begun = explained_by([causes[planted - 1]], late, forms)
    maker = search._weighing_maker(forms)
    _, fit = search._with_likeliest_timing(late, begun.weighing, begun.fit, maker)
    (cause,) = fit.causes
    assert cause.effect is forms[planted]
    assert cause.values == pytest.approx(causes[planted].values, rel=0.15)


def test_a_cause_is_told_in_the_variant_with_which_the_filters_are_likeliest(nominal):
    """A hull whose drag and added mass lie above its centre of mass: righting moments too large or too small, or thrust
    that acts elsewhere, make up for a part of that."""
    planted = next(effect for effect in PITCH_ROLL_COUPLING if effect.variant == "hull's forces")
    cause = Cause(planted, np.array([-0.1]))
    opposed = refitted(nominal, [cause.act(nominal.course).times(-1.0)])
    high = replace(opposed, acts=(), course=nominal.course)
    maker = search._weighing_maker(PITCH_ROLL_COUPLING)
    for variant in PITCH_ROLL_COUPLING[:3]:
        begun = explained_by([Cause(variant, variant.start())], high, PITCH_ROLL_COUPLING)
        weighing, fit = search._with_likeliest_variants(high, begun.weighing, begun.fit, maker)
        (found,) = fit.causes
        assert found.effect is planted
        assert found.values == pytest.approx(cause.values, rel=0.15)
        assert weighing.now.log_posterior > begun.now.log_posterior


def test_thrust_that_comes_earlier_than_the_vehicle_file_says_is_no_delay(monkeypatch):
    of_first_order, in_two_stages = thruster_lag(0.1)
    now = SimpleNamespace(course=None, log_posterior=0.0)
    weighing = SimpleNamespace(library=(COMMAND_DELAY, of_first_order, in_two_stages), now=now)
    likelier = SimpleNamespace(
        now=SimpleNamespace(log_posterior=9.0), fitted=lambda causes: SimpleNamespace(causes=causes)
    )
    monkeypatch.setattr(Cause, "act", lambda *_: None)
    monkeypatch.setattr(search, "refitted", lambda *_: None)
    monkeypatch.setattr(search, "_by_pushed", lambda now: now.log_posterior)
    monkeypatch.setattr(search, "_settled", lambda *given: (given[1], given[2]))
    quick = SimpleNamespace(causes=(Cause(of_first_order, np.array([0.09])),))
    _, fit = search._with_likeliest_timing(None, weighing, quick, lambda *_: likelier)
    assert all(cause.effect is not COMMAND_DELAY and cause.values[0] > 0.0 for cause in fit.causes)


LATE, LATE_BY_LAG = Cause(COMMAND_DELAY, np.array([0.1])), Cause(thruster_lag(0.1)[0], np.array([0.2]))
HIGH, HIGH_TOO = (Cause(effect, effect.start()) for effect in PITCH_ROLL_COUPLING[:2])


@pytest.mark.parametrize(
    ("told", "other", "rise", "nats", "taken"),
    [
        (LATE, LATE_BY_LAG, 3.1, 9.0, True),
        (LATE, LATE_BY_LAG, 3.0, 9.0, False),
        (HIGH, HIGH_TOO, 3.1, 3.1, True),
        (HIGH, HIGH_TOO, 3.0, 9.0, False),
        (HIGH, HIGH_TOO, 9.0, 3.0, False),
    ],
)
def test_another_form_of_a_cause_takes_its_place_from_three_nats_on(
    monkeypatch, told, other, rise, nats, taken
):
    """rise: of the filters with it; nats: that it saves at fixed noise levels."""
    weighing = replace_now(saving(nats), log_posterior=0.0)
    weighing.library = (told.effect, other.effect)
    likelier = replace_now(saving(nats), log_posterior=rise)
    monkeypatch.setattr(Cause, "act", lambda *_: None)
    monkeypatch.setattr(search, "refitted", lambda *_: None)
    monkeypatch.setattr(search, "_by_pushed", lambda now: now.log_posterior)
    monkeypatch.setattr(search, "may_be_cause", lambda *_: True)
    monkeypatch.setattr(search, "_settled", lambda *given: (likelier, given[2]))
    with_likeliest = search._with_likeliest_timing if told.effect.timing else search._with_likeliest_variants
    _, fit = with_likeliest(None, weighing, fitted([told], nats), lambda *_: likelier)
    assert [cause.effect for cause in fit.causes] == [other.effect if taken else told.effect]


@pytest.mark.parametrize(("rise", "settled_rise", "begun"), [(0.1, 7.1, 1), (0.0, 90.0, 0), (0.1, 7.0, 0)])
def test_a_search_begins_with_a_late_thrust_that_makes_the_filters_likelier_by_seven_nats(
    monkeypatch, rise, settled_rise, begun
):
    first, settled = (replace_now(saving(9.0), log_posterior=by) for by in (rise, settled_rise))
    nominal = SimpleNamespace(log_posterior=0.0, course=None)
    plain = SimpleNamespace(fitted=lambda _: fitted([], 0.0), library=(), now=nominal)
    monkeypatch.setattr(search, "_late_thrust", lambda *_: [LATE])
    monkeypatch.setattr(search, "_drift", lambda *_: [])
    monkeypatch.setattr(Cause, "act", lambda *_: None)
    monkeypatch.setattr(search, "refitted", lambda *_: first.now)
    monkeypatch.setattr(search, "_by_pushed", lambda now: now.log_posterior)
    monkeypatch.setattr(search, "_settled", lambda *given: (settled, given[2]))
    _, fit = search._begun(nominal, lambda now, _: plain if now is nominal else first)
    assert fit.causes == (LATE,) * begun


def test_a_late_thrust_is_known_no_better_than_its_stamps_and_dropped_where_these_may_make_it(nominal):
    delay = Cause(COMMAND_DELAY, np.array([0.2]))
    opposed = refitted(nominal, [delay.act(nominal.course).times(-1.0)])
    late = replace(opposed, acts=(), course=nominal.course, stamped_s=0.0)
    explanation = explained_by([delay], late, (COMMAND_DELAY,))
    (exact,) = confidence.covariance_of(explanation.weighing, explanation.fit).ravel()
    for stamped_s, stays in ((0.025, True), (0.11, False)):
        stamped = replace(late, stamped_s=stamped_s)
        explanation = explained_by([delay], stamped, (COMMAND_DELAY,))
        left, covariance = confidence.without_doubtful(explanation, stamped, (COMMAND_DELAY,))
        assert covariance.ravel().tolist() == ([pytest.approx(exact + stamped_s**2)] if stays else [])
        assert bool(left.causes) == stays


@pytest.mark.parametrize(("stamped_s", "found"), [(0.5e-3, True), (0.05, False)])
def test_a_late_thrust_within_the_error_of_the_stamps_takes_no_causes_place(nominal, stamped_s, found):
    delay = Cause(COMMAND_DELAY, np.array([0.06]))
    opposed = refitted(nominal, [delay.act(nominal.course).times(-1.0)])
    late = replace(opposed, acts=(), course=nominal.course, stamped_s=stamped_s)
    weighing = weighing_of(late, (COMMAND_DELAY,))
    fit = with_one_more(weighing, weighing.fitted(()))
    assert [cause.effect.name for cause in fit.causes] == (["command_delay"] if found else [])


@pytest.mark.parametrize("width_n", [0.43, 1.37, 2.9])
def test_a_dead_zone_that_ends_at_once_is_found_at_its_width(nominal, width_n):
    weighing, course = weighing_of(nominal, (DEAD_ZONE,)), nominal.course
    planted = weighing.rows.columns([Cause(DEAD_ZONE, np.array([width_n])).act(course)], course)[:, 0]
    weighing = replace(weighing, rows=replace(weighing.rows, value=weighing.rows.value + planted))
    none = weighing.fitted(())
    (_, _, cause), *_ = ranking.ranked_candidates(weighing.candidates_with_fit(none), none)
    fit = weighing.fitted((cause,))
    assert fit.causes[0].values == pytest.approx([width_n], rel=0.03)
    std = np.sqrt(confidence.covariance_of(weighing, fit)[0, 0])
    assert abs(fit.causes[0].values[0] - width_n) < 3.0 * std


@pytest.mark.parametrize(
    ("late_thrust_s", "stamped_s", "begun"),
    [
        ((0.06, 0.0), 0.001, [("delay", 0.06)]),
        ((0.06, 0.05), 0.001, [("lag", 0.15)]),
        ((0.02, 0.0), 0.001, []),
        ((0.0, 0.01), 0.001, []),
        ((0.06, 0.0), 0.03, [("delay", 0.06)]),
        ((0.05, 0.0), 0.03, []),
    ],
)
def test_a_search_begins_with_a_thrust_that_is_later_than_twenty_milliseconds_and_than_its_stamps_may_err(
    late_thrust_s, stamped_s, begun
):
    library = (DEAD_ZONE, COMMAND_DELAY, *thruster_lag(0.1))
    nominal = SimpleNamespace(late_thrust_s=late_thrust_s, stamped_s=stamped_s)
    causes = list(search._late_thrust(nominal, library))
    assert [(cause.effect.timing, pytest.approx(cause.values[0])) for cause in causes] == begun


def test_filters_that_are_fitted_once_more_start_where_they_stand_with_the_causes_they_have(draggy):
    spoilt, drag = draggy
    weighing = weighing_of(replace(spoilt, log_posterior=1e9), LIBRARY)
    fit = weighing.fitted([drag])
    lasts = search._lasting(spoilt, weighing, fit)
    again = refitted(spoilt, [cause.act(weighing.now.course) for cause in fit.causes], weighing.now)
    assert lasts == again.log_posterior
    assert lasts > spoilt.log_posterior


@pytest.mark.parametrize(
    ("before", "after", "refused"),
    [
        ([QUADRATIC_DRAG], [DEAD_ZONE, STEADY_CURRENT], {DEAD_ZONE.label}),
        ([QUADRATIC_DRAG], [QUADRATIC_DRAG, STEADY_CURRENT], {STEADY_CURRENT.label}),
        ([QUADRATIC_DRAG], [DEAD_ZONE], {DEAD_ZONE.label}),
    ],
)
def test_of_a_swap_and_a_further_cause_that_fail_together_the_swap_is_tried_no_more(before, after, refused):
    fit, better = (
        fitted([Cause(each, each.start()) for each in effects], 9.0) for effects in (before, after)
    )
    new = {each.label for each in after} - {each.label for each in before}
    assert search._refused_first(new, better, fit) == refused


def test_a_cause_has_to_save_more_for_each_form_and_thruster_in_which_it_was_sought():
    one = Thruster((1.0, 0.0, 0.0), (0.0, 0.1, 0.0))
    for count in (2, 8):
        effects = library(Configuration(10.0, (0.1, 0.2, 0.3), (one,) * count), 0.1)
        among = {"weak_thruster": count, "pitch_roll_coupling": 5, "thruster_lag": 2, "command_delay": 1}
        for effect in effects:
            if effect.name in among:
                assert sought_nats(effect) == pytest.approx(np.log(among[effect.name]))
                gain = least_gain(Cause(effect, effect.start()))
                assert gain == pytest.approx(7.0 + np.log(among[effect.name]))
        assert {effect.name for effect in effects} > set(among)
        # A sea's periods count by what it has to save.
        assert {least_gain(Cause(effect, effect.start())) for effect in effects if effect.sea} == {20.0}
