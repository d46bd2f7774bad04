"""Priors and the thrust's scale: products of Gaussians with answers that can be worked out by hand."""

from dataclasses import replace

import fitted
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.vehicle.config import dive_mark
from identify.doubt import Outcome
from identify.estimators.answer import answered

SURGE = {"M_u": 100.0, "D_u": 50.0}


def answer_of(relative, priors=None, scale_std=0.1, values=None):
    file = fitted.vehicle_file(scale_std, priors=priors or {})
    return answered(fitted.fit(values or SURGE, np.asarray(relative)), fitted.dive(), file)


def test_without_a_prior_values_and_intervals_stay_as_they_were_fitted():
    fit = fitted.fit(SURGE, np.diag([1e-4, 4e-4]))
    answer = answer_of(np.diag([1e-4, 4e-4]))
    assert answer["M_u"].value == pytest.approx(100.0)
    assert answer["M_u"].low95 == fit["M_u"].low95
    assert answer["D_u"].std == fit["D_u"].std
    assert answer["M_u"].share_from_prior == 0.0


def test_intervals_hold_given_the_thrust_and_what_it_would_add_stands_beside_them():
    answer = answer_of(np.diag([1e-4, 4e-4]), scale_std=0.05)
    assert answer["M_u"].scale_std == pytest.approx(5.0)
    assert answer["X_udot"].scale_std == pytest.approx(5.0)
    assert not answer.thrust_scale.weighed
    assert "known to 5 %" in answer.thrust_scale.sentence


def test_the_first_interval_holds_what_the_thrust_may_be_off_by_and_another_does_not():
    answer = answer_of(np.diag([4e-4, 9e-4]), scale_std=0.05)
    mass, added = answer["M_u"], answer["X_udot"]
    assert np.log(np.array(mass.with_thrust) / 100.0) == pytest.approx([-0.1055, 0.1055], abs=1e-4)
    assert mass.at_thrust == (mass.low95, mass.high95)
    assert np.log(np.array(mass.at_thrust) / 100.0) == pytest.approx([-0.0392, 0.0392], abs=1e-4)
    # Of 100 kg that thrust weighs, 5 % are 5 kg of whatever water is in them.
    reach = np.hypot(added.high95 - added.value, 1.96 * 5.0)
    assert added.with_thrust.high95 - added.value == pytest.approx(reach, rel=1e-3)
    assert added.at_thrust == (added.low95, added.high95)


def test_a_thrust_that_is_known_exactly_leaves_one_interval():
    mass = answer_of(np.diag([4e-4, 9e-4]), scale_std=0.0)["M_u"]
    assert mass.with_thrust == mass.at_thrust == (mass.low95, mass.high95)


def test_beside_a_force_standard_the_interval_given_the_thrust_is_about_the_value_with_that_thrust():
    mass = answer_of(np.diag([1e-4, 1e-4]), {"M_u": fitted.prior(105.0, 0.001)}, scale_std=0.1)["M_u"]
    assert mass.value == pytest.approx(105.0, rel=1e-3)
    assert mass.with_thrust == (mass.low95, mass.high95)
    low, high = mass.at_thrust
    assert np.sqrt(low * high) == pytest.approx(100.0, rel=1e-3)
    assert np.log(high / low) == pytest.approx(2 * 1.96 * 0.01, rel=1e-2)


def test_a_prior_on_the_thrust_itself_is_a_product_of_two_gaussians():
    answer = answer_of(np.diag([0.02**2, 4e-4]), {"M_u": fitted.prior(102.0, 0.02, "thrust")})
    assert answer["M_u"].value == pytest.approx(np.sqrt(100.0 * 102.0))
    assert answer["M_u"].relative_std == pytest.approx(0.02 / np.sqrt(2))
    assert answer["M_u"].share_from_prior == pytest.approx(0.5)
    assert answer["D_u"].value == pytest.approx(50.0)
    assert answer["M_u"].scale_std == pytest.approx(0.1 * answer["M_u"].value)


def test_a_prior_moves_what_the_dive_ties_to_it():
    relative = np.array([[0.04, 0.036], [0.036, 0.04]])
    answer = answer_of(relative, {"M_u": fitted.prior(110.0, 1e-6, "thrust")})
    assert answer["M_u"].value == pytest.approx(110.0, rel=1e-6)
    assert answer["D_u"].value == pytest.approx(50.0 * 1.1**0.9, rel=1e-6)
    assert answer["D_u"].relative_std == pytest.approx(np.sqrt(0.04 - 0.036**2 / 0.04), rel=1e-6)


def test_a_weighed_mass_tells_the_thrust_and_with_it_every_other_parameter():
    """The dive knows both to 0.1 % but for the thrust; the weighed mass says that the thrust is 5 % stronger."""
    answer = answer_of(np.diag([1e-6, 1e-6]), {"M_u": fitted.prior(105.0, 0.001)}, scale_std=0.1)
    assert answer.thrust_scale.weighed
    assert answer.thrust_scale.shift == pytest.approx(0.05, abs=1e-4)
    assert answer["D_u"].value == pytest.approx(52.5, rel=1e-3)
    assert answer["D_u"].relative_std == pytest.approx(np.sqrt(1e-6 + 1e-6 + 1e-6), rel=1e-2)
    assert answer["M_u"].scale_std == 0.0
    assert "thrust_scale" not in {name for d in answer.null_directions for name in d.weights}


def test_with_a_weighed_mass_the_intervals_include_what_is_left_of_the_thrust():
    answer = answer_of(np.diag([1e-6, 1e-6]), {"M_u": fitted.prior(100.0, 0.1)}, scale_std=0.1)
    assert answer["D_u"].relative_std == pytest.approx(0.1 / np.sqrt(2), rel=1e-3)


@pytest.mark.parametrize(("percent", "taken"), [(5.0, True), (7.0, False)])
def test_a_prior_further_than_three_standard_errors_is_left_out_and_doubted(percent, taken):
    priors = {"M_u": fitted.prior(100.0 * np.exp(percent / 100), 0.01, "thrust", "weighed 2026-03-01")}
    answer = answer_of(np.diag([0.0175**2, 1e-4]), priors)
    assert (answer["M_u"].value > 100.5) is taken
    assert (answer.outcome is Outcome.CONVERGED) is taken
    assert (
        any("weighed 2026-03-01" in d.sentence and "left out" in d.sentence for d in answer.doubts)
        is not taken
    )


def test_what_the_dive_says_nothing_of_takes_its_prior_and_stays_not_identifiable():
    answer = answer_of(np.diag([1e-4, 1e-4]), {"M_w": fitted.prior(130.0, 0.05, source="weighed")})
    assert answer["M_w"].value == 130.0
    assert answer["M_w"].share_from_prior == 1.0
    assert not answer["M_w"].identifiable
    assert "prior alone (weighed)" in answer["M_w"].reason
    assert "M_w" not in answer.values()


def test_a_prior_can_make_identifiable_what_the_dive_alone_leaves_open():
    answer = answer_of(np.diag([1e-4, 0.5]), {"D_u": fitted.prior(55.0, 0.05, "thrust")})
    assert answer["D_u"].identifiable
    assert answer["D_u"].share_from_prior > 0.99
    assert answer["D_u"].value == pytest.approx(55.0, rel=0.01)


def test_a_method_without_intervals_says_that_priors_were_not_joined():
    file = fitted.vehicle_file(priors={"M_u": fitted.prior(100.0, 0.1)})
    answer = answered(fitted.fit({}, np.zeros((0, 0))), fitted.dive(), file)
    assert any("states no interval" in note for note in answer.notes)


TIED = np.array([[1e-4, 0.99e-4], [0.99e-4, 1e-4]])
"""Two masses that the dive knows to 1 % and their ratio to 0.14 %."""

MASSES = {"M_u": 111.7, "M_v": 112.3}


def test_priors_that_each_fit_the_dive_but_not_each_other_are_all_left_out_and_doubted():
    apart = {"M_u": fitted.prior(123.0, 0.004, source="towed"), "M_v": fitted.prior(101.0, 0.005)}
    answer = answer_of(TIED, apart, values=MASSES)
    assert answer.outcome is Outcome.DISAGREES
    (doubt,) = answer.doubts
    assert doubt.about == ("M_u", "M_v")
    assert "contradict each other" in doubt.sentence
    assert "123.00 ± 0.49 kg (towed)" in doubt.sentence
    assert answer["M_u"].value == pytest.approx(111.7)
    assert not answer.thrust_scale.weighed


def test_priors_that_the_thrust_alone_moves_are_both_taken():
    together = {"M_u": fitted.prior(123.0, 0.004), "M_v": fitted.prior(123.7, 0.005)}
    answer = answer_of(TIED, together, values=MASSES)
    assert answer.outcome is Outcome.CONVERGED
    assert answer.thrust_scale.shift == pytest.approx(0.1, abs=0.01)


def test_thrust_moves_nothing_that_the_righting_moment_weighed():
    fit = fitted.fit({"M_u": 100.0, "I_q": 12.0}, 1e-4 * np.eye(2), rest_on_righting=("I_q",))
    free = answered(fit, fitted.dive(), fitted.vehicle_file(0.1))
    assert free["M_u"].scale_std == pytest.approx(10.0)
    assert free["I_q"].scale_std == 0.0
    assert set(free.null_directions[-1].weights) == {"thrust_scale", "M_u"}
    assert "that thrust weighs would be 1 % larger" in free.thrust_scale.sentence
    file = fitted.vehicle_file(0.1, priors={"M_u": fitted.prior(110.0, 0.001)})
    weighed = answered(fit, fitted.dive(), file)
    assert weighed["M_u"].value == pytest.approx(110.0, rel=1e-3)
    assert weighed["I_q"].value == pytest.approx(12.0)
    assert weighed["I_q"].relative_std == pytest.approx(0.01)


def test_a_weighed_moment_of_inertia_that_thrust_did_not_weigh_tells_no_thrust():
    fit = fitted.fit({"M_u": 100.0, "I_q": 12.0}, 1e-4 * np.eye(2), rest_on_righting=("I_q",))
    file = fitted.vehicle_file(0.1, priors={"I_q": fitted.prior(12.1, 0.01)})
    answer = answered(fit, fitted.dive(), file)
    assert not answer.thrust_scale.weighed
    assert answer["I_q"].value == pytest.approx(np.sqrt(12.0 * 12.1))
    assert answer["M_u"].value == pytest.approx(100.0)


def test_what_holds_given_the_thrust_stands_beside_what_was_weighed():
    weighed = {"M_u": fitted.prior(110.0, 0.001), "D_u": fitted.prior(51.0, 0.02, "thrust")}
    answer = answer_of(np.diag([1e-4, 4e-4]), weighed)
    assert answer["D_u"].value > 54.0
    assert answer["D_u"].given_thrust == pytest.approx(np.sqrt(50.0 * 51.0))
    assert answer["D_u"].given_thrust_std / answer["D_u"].given_thrust == pytest.approx(0.02 / np.sqrt(2))
    assert answer["M_u"].given_thrust == pytest.approx(100.0)


def test_a_second_round_of_priors_knows_no_more_of_the_thrust_than_what_was_weighed():
    weighed = {"M_u": fitted.prior(105.0, 0.04)}
    first = answer_of(np.diag([1e-4, 1e-4]), weighed)
    kept = {"D_u": fitted.prior(first["D_u"].given_thrust, 0.1, "thrust")}
    second = answer_of(np.diag([1e-4, 1e-4]), weighed | kept)
    assert second.thrust_scale.std == pytest.approx(first.thrust_scale.std, rel=1e-6)


def test_an_answer_names_all_dives_that_its_priors_rest_on():
    priors = {
        "M_u": replace(fitted.prior(101.0, 0.01, "thrust"), dive_sha256="2" * 64, earlier_dives=("3" * 16,)),
        "D_u": replace(fitted.prior(50.0, 0.1, "thrust"), dive_sha256="2" * 64),
    }
    answer = answer_of(np.diag([1e-4, 4e-4]), priors)
    assert answer.prior_dives == ("2" * 16, "3" * 16)
    assert answer.to_json()["prior_dives"] == ["2" * 16, "3" * 16]


@pytest.mark.parametrize(
    ("origin", "left_out"),
    [
        ({"dive_sha256": "1" * 64}, True),
        ({"dive_sha256": "2" * 64, "earlier_dives": (dive_mark("1" * 64),)}, True),
        ({"dive_sha256": "2" * 64, "dive_opening": "9" * 64}, True),
        ({"dive_sha256": "2" * 64, "dive_opening": "8" * 64, "earlier_dives": (dive_mark("9" * 64),)}, True),
        ({"dive_sha256": "2" * 64, "dive_opening": "7" * 64}, False),
    ],
    ids=[
        "itself",
        "through a later dive",
        "of a cut copy",
        "of a copy through a later dive",
        "of another dive",
    ],
)
def test_a_prior_that_rests_on_this_very_dive_is_left_out_and_named(origin, left_out):
    """Dive A was accepted, then was prior for dive B, and B was accepted: A again would count itself. The hash of a
    copy that was cut is another, its beginning is the same.
    """
    prior = replace(fitted.prior(102.0, 0.01, "thrust"), **origin)
    dive = replace(fitted.dive(), opening="9" * 64)
    answer = answered(
        fitted.fit(SURGE, np.diag([1e-4, 4e-4])), dive, fitted.vehicle_file(priors={"M_u": prior})
    )
    assert answer.outcome is Outcome.CONVERGED
    assert (answer["M_u"].share_from_prior == 0.0) is left_out
    assert any("M_u rest on this very dive" in doubt.sentence for doubt in answer.doubts) is left_out
    assert answer.prior_dives == (() if left_out else ("2" * 16, "7" * 16))


def test_a_dive_without_an_opening_is_not_taken_for_another_without_one():
    other = replace(fitted.prior(102.0, 0.01, "thrust"), dive_sha256="2" * 64)
    assert answer_of(np.diag([1e-4, 4e-4]), {"M_u": other})["M_u"].share_from_prior > 0


def test_a_prior_that_was_left_out_brings_no_dive_into_the_answer():
    far = replace(fitted.prior(150.0, 0.01, "thrust"), dive_sha256="2" * 64)
    assert answer_of(np.diag([1e-4, 4e-4]), {"M_u": far}).prior_dives == ()


def test_a_prior_leaves_anothers_lopsided_interval_lopsided():
    fit = fitted.fit(SURGE, np.diag([1e-4, 1e-2]))
    totals = tuple(replace(t, high95=80.0) if t.name == "D_u" else t for t in fit.parameters)
    file = fitted.vehicle_file(priors={"M_u": fitted.prior(101.0, 0.01, "thrust")})
    answer = answered(replace(fit, parameters=totals), fitted.dive(), file)
    assert answer["D_u"].high95 == pytest.approx(80.0)
    assert answer["D_u"].low95 == pytest.approx(fit["D_u"].low95)
    assert answer["D_u"].share_from_prior == 0.0


def test_a_prior_leaves_anothers_bound_where_it_was():
    fit = fitted.fit(SURGE | {"M_v": 3e5}, 1e-4 * np.eye(3))
    priors = {"M_u": fitted.prior(101.0, 0.01, "thrust")}
    answer = answered(fit, fitted.dive(), fitted.vehicle_file(priors=priors))
    assert answer.outcome is Outcome.AT_BOUND
    assert "upper bound" in answer["M_v"].reason
    assert not answer["M_v"].identifiable


def test_what_comes_through_anothers_prior_counts_as_from_the_prior():
    answer = answer_of(TIED, {"M_u": fitted.prior(111.7, 1e-5, "thrust")}, values=MASSES)
    assert answer["M_v"].share_from_prior == pytest.approx(0.99**2, rel=1e-3)


@settings(max_examples=40)
@given(
    st.lists(st.floats(0.005, 0.2), min_size=2, max_size=2),
    st.floats(-0.95, 0.95),
    st.floats(0.01, 0.3),
    st.sampled_from(["weight", "thrust"]),
    st.floats(-0.5, 0.5),
)
def test_a_prior_never_widens_what_the_dive_and_the_thrust_leave_open(
    stds, correlation, width, rests_on, off
):
    tied = correlation * stds[0] * stds[1]
    relative = np.array([[stds[0] ** 2, tied], [tied, stds[1] ** 2]])
    prior = fitted.prior(100.0 * float(np.exp(off * width)), width, rests_on)
    answer = answer_of(relative, {"M_u": prior})
    thrust = 0.1 if answer.thrust_scale.weighed else 0.0
    for name, std in zip(("M_u", "D_u"), stds, strict=True):
        assert answer[name].relative_std <= np.hypot(std, thrust) * (1 + 1e-9)
    assert answer["M_u"].relative_std <= width * (1 + 1e-9)
    assert np.linalg.eigvalsh(answer.covariance).min() > 0
