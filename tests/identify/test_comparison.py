"""Two methods on one dive: disagreement is measured by the less sure of them, and explained by what each doubts."""

from dataclasses import replace

import fitted
import numpy as np
import pytest

from identify.comparison import LEAST_DIFFERENCE, compare, doubted
from identify.identification import Doubt, Outcome, Partner, disturbance, noise, time_constant, trim
from identify.report.compared import comparison_section

SURGE = {"M_u": 100.0, "D_u": 50.0}


def by(method, mass=100.0, std=0.01, **keys):
    return fitted.fit(SURGE | {"M_u": mass}, std**2 * np.eye(2), method=method, **keys)


def difference(compared, name="M_u"):
    return next(d for d in compared.differences if d.name == name)


def test_the_distance_is_in_standard_errors_of_the_less_sure():
    found = difference(compare(by("likelihood", 100.0, 0.001), by("pinn", 100.0 * np.exp(0.014), 0.01)))
    assert found.distance == pytest.approx(1.4)
    assert not found.disagrees


def test_two_that_agree_say_so_in_one_sentence():
    (sentence,) = compare(by("likelihood"), by("pinn", 101.0)).sentences
    assert sentence.startswith("Likelihood and pinn agree in all 2 parameters")
    assert "1 standard errors apart, in M_u (+1 %)" in sentence


def test_beyond_the_intervals_they_disagree_and_why_is_what_either_doubts():
    doubt = Doubt(
        ("M_u",), "In surge a drag is missing from the model", "mass holds for this dive.", Outcome.DISAGREES
    )
    found = compare(by("likelihood", doubts=(doubt,)), by("pinn", 110.0))
    (told,) = found.disagreements
    assert told.name == "M_u"
    assert "+10.0 % and 9.5 standard errors apart" in told.why
    assert "likelihood doubts it itself (in surge a drag is missing from the model)" in told.why


@pytest.mark.parametrize(("apart", "disagree"), [(1.7, False), (1.95, False), (1.97, True)])
def test_they_disagree_from_where_each_lies_outside_the_others_interval(apart, disagree):
    found = difference(compare(by("likelihood"), by("pinn", 100.0 * np.exp(0.01 * apart))))
    assert found.disagrees is disagree


def test_a_value_that_either_interval_holds_is_no_disagreement():
    found = difference(compare(by("likelihood", 100.0, 0.001), by("pinn", 101.0, 0.01)))
    assert not found.disagrees


@pytest.mark.parametrize(("share", "disagree"), [(0.99, False), (1.01, True)])
def test_a_difference_that_changes_nothing_is_none_however_sharp_both_are(share, disagree):
    first = by("likelihood", std=1e-4)
    compared = compare(first, by("pinn", 100.0 * (1 + share * LEAST_DIFFERENCE), std=1e-4))
    assert difference(compared).disagrees is disagree
    assert (doubted(compared) is first) is not disagree


def test_a_different_sea_explains_a_difference():
    seas = ({disturbance(0): 1.0}, {disturbance(0): 2.5})
    found = compare(by("likelihood", nuisance=seas[0]), by("pinn", 110.0, nuisance=seas[1]))
    assert "they take the disturbance in surge differently (likelihood 1 N, pinn 2.5 N)" in found.sentences[0]


def test_without_a_doubt_of_either_nothing_is_made_up():
    found = compare(by("likelihood"), by("pinn", 110.0))
    assert "neither doubts it, and they took noise and disturbance alike" in found.sentences[0]
    assert "likelihood 100 ± 1 kg and pinn 110 ± 1.1" in found.sentences[0]


def with_partner(fit, correlation):
    partners = [
        replace(p, partner=Partner("D_u", correlation) if p.name == "M_u" else None) for p in fit.parameters
    ]
    return replace(fit, parameters=tuple(partners))


def test_why_names_what_the_coefficient_is_entangled_with_by_whom():
    found = compare(with_partner(by("likelihood"), 0.93), with_partner(by("pinn", 110.0), -0.05))
    assert "M_u is correlated +0.93 with D_u by likelihood;" in found.sentences[0]
    alike = compare(with_partner(by("likelihood"), 0.93), with_partner(by("pinn", 110.0), 0.93))
    assert "M_u is correlated +0.93 with D_u by likelihood and pinn;" in alike.sentences[0]


def test_why_names_the_method_that_the_prior_is_nearer_to():
    prior = fitted.prior(108.0, 0.02)
    found = compare(by("likelihood"), by("pinn", 110.0), {"M_u": prior})
    assert "the vehicle file's prior 108 ± 2.2 kg is nearer to pinn" in found.sentences[0]


def test_why_names_another_time_constant_and_another_sensor_noise_but_no_trim():
    first = {
        time_constant(0): 2.0, noise(0, "dvl", False): 0.005, trim(0): 0.1, disturbance(1): 1.0,
    }  # fmt: skip
    second = {name: 2 * level for name, level in first.items()}
    (told,) = compare(by("likelihood", nuisance=first), by("pinn", 110.0, nuisance=second)).sentences
    assert "the disturbance time constant in surge differently (likelihood 2 s, pinn 4 s)" in told
    assert "the dvl noise in surge differently (likelihood 0.005 m/s, pinn 0.01 m/s)" in told
    assert "trim" not in told
    assert "sway" not in told


def test_a_disagreement_is_a_doubt_of_the_first_method_and_its_outcome():
    compared = compare(by("likelihood"), by("pinn", 110.0))
    answer = doubted(compared)
    assert answer.outcome is Outcome.DISAGREES
    assert [(d.about, d.sentence) for d in answer.doubts] == [(("M_u",), compared.sentences[0])]
    assert answer["M_u"].value == 100.0
    assert answer.doubts[0].clause.startswith("on M_u two methods disagree")


def test_a_disagreement_makes_no_worse_outcome_better():
    worse = by("likelihood", outcome=Outcome.NOT_IDENTIFIABLE)
    assert doubted(compare(worse, by("pinn", 110.0))).outcome is Outcome.NOT_IDENTIFIABLE


def test_agreement_leaves_the_answer_as_it_is():
    first = by("likelihood")
    assert doubted(compare(first, by("pinn", 101.0))) is first


def test_a_method_that_did_not_converge_is_named():
    found = compare(by("likelihood"), by("pinn", 110.0, outcome=Outcome.AT_BOUND))
    assert "pinn ended with 'stopped at a bound'" in found.sentences[0]


def test_what_one_of_them_can_not_tell_is_no_disagreement():
    found = compare(by("likelihood"), by("pinn", 300.0, 0.5))
    assert np.isnan(difference(found).distance)
    assert not found.disagreements


def test_a_method_without_intervals_disagrees_with_nothing():
    bare = tuple(replace(p, std=np.nan, low95=np.nan, high95=np.nan) for p in by("paper", 200.0).parameters)
    found = compare(by("likelihood"), replace(by("paper"), parameters=bare))
    assert found.sentences == (
        "No parameter has an interval by both likelihood and paper: there is nothing to compare.",
    )


def test_two_nearly_efficient_estimates_of_the_same_noise_hardly_ever_disagree():
    """The second is the first with noise of its own, half as large: its variance is the larger, Hausman's case."""
    rng = np.random.default_rng(100_001)
    disagreed = 0
    for _ in range(400):
        first = 0.01 * rng.normal()
        second = first + 0.005 * rng.normal()
        found = compare(by("a", np.exp(first), 0.01), by("b", np.exp(second), np.hypot(0.01, 0.005)))
        disagreed += difference(found).disagrees
    assert disagreed <= 2


def test_the_json_names_the_disagreeing_parameters_with_why():
    data = compare(by("likelihood"), by("pinn", 110.0)).to_json()
    assert data["method"] == "pinn"
    mass, sway, *_ = data["parameters"]
    assert mass["disagrees"] is True
    assert mass["value"] == 110.0
    assert mass["difference_in_std"] == pytest.approx(np.log(1.1) / 0.01)
    assert "standard errors apart" in mass["why"]
    assert sway["difference_in_std"] is None
    assert "why" not in sway


def test_the_report_warns_of_a_disagreement_and_is_calm_without():
    loud = comparison_section(compare(by("likelihood"), by("pinn", 110.0)))
    assert loud.warning.startswith("Warning: the methods disagree on M_u")
    assert loud.tables[0].rows[0][-1] == "DISAGREE"
    calm = comparison_section(compare(by("likelihood"), by("pinn")))
    assert calm.warning == ""
    assert "agree in all 2" in calm.text


def test_a_coefficient_that_a_method_cannot_tell_apart_from_it_leans_on_the_one_in_dispute():
    close = replace(by("likelihood"), parameters=tuple(
        replace(one, partner=Partner("D_u", 0.99)) if one.name == "M_u" else one for one in by("likelihood").parameters
    ))  # fmt: skip
    (doubt,) = doubted(compare(close, by("pinn", 110.0))).doubts
    assert (doubt.about, doubt.also) == (("M_u",), ("D_u",))
