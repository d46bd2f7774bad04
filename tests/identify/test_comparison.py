"""Two methods on one dive: their shared work, how far they differ, and the words on it."""

from dataclasses import replace
from pathlib import Path
from threading import Barrier, Thread
from types import SimpleNamespace

import closed_loop
import fitted
import numpy as np
import pytest

from bridge.errors import FitError
from bridge.plain import plain
from bridge.vehicle.config import load_vehicle
from identify.dive import Dive
from identify.doubt import Doubt, Outcome
from identify.estimators.axes.build import build_axes
from identify.estimators.comparison import compare, doubted
from identify.estimators.filter import information
from identify.estimators.likelihood.fit import rough_fit
from identify.identification import Partner
from identify.nuisance import disturbance, noise, time_constant, trim
from identify.report.identification import comparison_section, further_remarks
from identify.run.identify import ANSWERED, compiles_first, identify
from identify.threads import shared

SURGE = {"M_u": 100.0, "D_u": 50.0}


def by(method, mass=100.0, std=0.01, **keys):
    return fitted.fit(SURGE | {"M_u": mass}, std**2 * np.eye(2), method=method, **keys)


def difference(compared, name="M_u"):
    return next(d for d in compared.differences if d.name == name)


def test_the_distance_is_in_standard_errors_of_the_less_sure():
    gap = difference(compare(by("likelihood", 100.0, 0.001), by("pinn", 100.0 * np.exp(0.014), 0.01)))
    assert gap.distance == pytest.approx(1.4)
    (sentence,) = compare(by("likelihood"), by("pinn", 101.0)).sentences
    assert sentence.startswith("Likelihood and pinn agree in all 2 parameters")
    assert "1 standard errors apart, in M_u (+1 %)" in sentence
    assert not gap.disagrees


def test_beyond_the_intervals_they_disagree_and_why_is_what_either_doubts():
    doubt = Doubt(
        ("M_u",), "In surge a drag is missing from the model", "mass holds for this dive.", Outcome.DISAGREES
    )
    comparison = compare(by("likelihood", doubts=(doubt,)), by("pinn", 110.0))
    (disagreement,) = comparison.disagreements
    assert disagreement.name == "M_u"
    assert "+10.0 % and 9.5 standard errors apart" in disagreement.why
    assert "likelihood doubts it itself (in surge a drag is missing from the model)" in disagreement.why


@pytest.mark.parametrize(("apart", "disagree"), [(1.7, False), (1.95, False), (1.97, True)])
def test_they_disagree_from_where_each_lies_outside_the_others_interval(apart, disagree):
    gap = difference(compare(by("likelihood"), by("pinn", 100.0 * np.exp(0.01 * apart))))
    assert gap.disagrees is disagree


@pytest.mark.parametrize(("share", "disagree"), [(0.99, False), (1.01, True)])
def test_a_difference_that_changes_nothing_is_none_however_sharp_both_are(share, disagree):
    first = by("likelihood", std=1e-4)
    compared = compare(first, by("pinn", 100.0 * (1 + share * 0.005), std=1e-4))
    assert difference(compared).disagrees is disagree
    assert (doubted(compared) is first) is not disagree


def with_partner(fit, correlation):
    partners = [
        replace(p, partner=Partner("D_u", correlation) if p.name == "M_u" else None) for p in fit.parameters
    ]
    return replace(fit, parameters=tuple(partners))


def test_why_names_what_the_coefficient_is_entangled_with_by_whom_and_that_leans_on_it():
    comparison = compare(with_partner(by("likelihood"), 0.93), with_partner(by("pinn", 110.0), -0.05))
    assert "M_u is correlated +0.93 with D_u by likelihood;" in comparison.sentences[0]
    (doubt,) = doubted(comparison).doubts
    assert (doubt.about, doubt.also) == (("M_u",), ("D_u",))
    alike = compare(with_partner(by("likelihood"), 0.93), with_partner(by("pinn", 110.0), 0.93))
    assert "M_u is correlated +0.93 with D_u by likelihood and pinn;" in alike.sentences[0]


def test_why_names_another_sea_another_time_constant_and_another_sensor_noise_but_no_trim():
    first = {
        disturbance(0): 1.0, time_constant(0): 2.0, noise(0, "dvl", False): 0.005, trim(0): 0.1, disturbance(1): 1.0,
    }  # fmt: skip
    second = {name: 2 * level for name, level in first.items()}
    (sentence,) = compare(by("likelihood", nuisance=first), by("pinn", 110.0, nuisance=second)).sentences
    assert "they take the disturbance in surge differently (likelihood 1 N, pinn 2 N)" in sentence
    assert "the disturbance time constant in surge differently (likelihood 2 s, pinn 4 s)" in sentence
    assert "the dvl noise in surge differently (likelihood 0.005 m/s, pinn 0.01 m/s)" in sentence
    assert "trim" not in sentence
    assert "sway" not in sentence


def test_a_disagreement_is_a_doubt_of_the_first_method_and_its_outcome_unless_that_is_worse():
    compared = compare(by("likelihood"), by("pinn", 110.0))
    answer = doubted(compared)
    assert answer.outcome is Outcome.DISAGREES
    assert [(d.about, d.sentence) for d in answer.doubts] == [(("M_u",), compared.sentences[0])]
    assert answer["M_u"].value == 100.0
    assert answer.doubts[0].clause.startswith("on M_u two methods disagree")
    worse = by("likelihood", outcome=Outcome.NOT_IDENTIFIABLE)
    assert doubted(compare(worse, by("pinn", 110.0))).outcome is Outcome.NOT_IDENTIFIABLE


def test_a_method_without_intervals_or_too_wide_ones_disagrees_with_nothing():
    vague = compare(by("likelihood"), by("pinn", 300.0, 0.5))
    assert np.isnan(difference(vague).distance)
    assert not vague.disagreements
    bare = tuple(replace(p, std=np.nan, low95=np.nan, high95=np.nan) for p in by("paper", 200.0).parameters)
    comparison = compare(by("likelihood"), replace(by("paper"), parameters=bare))
    assert comparison.sentences == (
        "No parameter has an interval by both likelihood and paper: there is nothing to compare.",
    )


def test_the_json_names_the_disagreeing_parameters_with_why():
    data = plain(compare(by("likelihood"), by("pinn", 110.0)).to_json())
    assert data["method"] == "pinn"
    mass, sway, *_ = data["parameters"]
    assert mass["disagrees"] is True
    assert mass["value"] == 110.0
    assert mass["difference_in_std"] == pytest.approx(np.log(1.1) / 0.01)
    assert "standard errors apart" in mass["why"]
    assert sway["difference_in_std"] is None
    assert "why" not in sway


def answer_by(method, values=SURGE, std=0.01, **keys):
    return fitted.fit(values, std**2 * np.eye(len(values)), method=method, **keys)


def drag(score, axis="surge"):
    return Doubt(("M_u", "D_u"), f"In {axis} a drag is missing ({score} standard errors)", "dive slower.")


def test_a_doubt_of_both_that_differs_by_a_figure_is_not_said_again_and_another_of_the_same_coefficients_is():
    late = Doubt(("M_u", "D_u"), "In surge thrust is late by 20 ms", "mend the lag.")
    assert (
        further_remarks(
            compare(answer_by("likelihood", doubts=(drag(9),)), answer_by("pinn", doubts=(drag(8),)))
        )
        == ()
    )
    assert further_remarks(
        compare(answer_by("likelihood", doubts=(late,)), answer_by("pinn", doubts=(drag(8),)))
    ) == ("Pinn: In surge a drag is missing (8 standard errors): dive slower.",)


def test_the_page_says_it_whether_or_not_the_methods_disagree():
    for mass in (100.0, 130.0):
        comparison = compare(
            answer_by("likelihood"), answer_by("pinn", {"M_u": mass}, outcome=Outcome.AT_BOUND)
        )
        section = comparison_section(comparison)
        assert bool(section.warning) is (mass > 100.0)
        assert (section.tables[0].rows[0][-1] == "DISAGREE") is (mass > 100.0)
        assert "Pinn ended with 'stopped at a bound'." in section.text
        assert f"Pinn gives no D_u: {fitted.NOT_DIVED}" in section.text


def test_how_far_two_methods_are_apart_has_hundredths_of_a_standard_error_and_no_more():
    comparison = compare(answer_by("likelihood"), answer_by("pinn", {"M_u": 100.001}))
    (distance,) = (row[4] for row in comparison_section(comparison).tables[0].shown if row[0] == "M_u")
    assert distance in ("0.00", "−0.00")


class Made:
    pass


def counted():
    """Work that is shared, and what it was asked with."""
    asked = []

    def work(*arguments):
        asked.append(arguments)
        return Made()

    return shared(work), asked


def test_two_who_ask_at_the_same_time_get_one_result_of_one_piece_of_work_and_nothing_is_kept():
    of, asked = counted()
    both, made, values = Barrier(2), Made(), []

    def ask():
        held = of(made, "survey")
        both.wait(60.0)
        values.append(held.value)

    threads = [Thread(target=ask) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60.0)
    assert values[0] is values[1]
    assert len(asked) == 1
    first = of(made, "hovering").value
    assert of(made, "hovering").value is not first


def test_text_and_tuples_are_the_same_where_they_are_equal_and_all_else_where_it_is_the_same_object():
    of, _ = counted()
    made, like = Made(), Made()
    held = of(made, "survey", (1, 2))
    assert of(made, "".join(("sur", "vey")), (1, *[2])) is held
    assert of(made, "hovering", (1, 2)) is not held
    assert of(like, "survey", (1, 2)) is not held


def test_what_the_work_raises_everybody_hears():
    def fails():
        raise ValueError("no axes")

    held = shared(fails)()
    for _ in range(2):
        with pytest.raises(ValueError, match="no axes"):
            _ = held.value


def test_axes_that_are_doubted_are_begun_apart_from_those_that_are_not():
    file = closed_loop.vehicle_file()
    built = build_axes(closed_loop.dive(np.random.default_rng(3), seconds=30.0), file, "only")
    shape = file.vehicle.configurations["only"]
    plain, doubted = rough_fit(built, shape, ()), rough_fit(built, shape, (0,))
    assert rough_fit(built, shape, ()) is plain
    assert plain.value.joint.apart == ()
    assert doubted.value.joint.apart == (0,)


FILE = load_vehicle(str(Path(__file__).resolve().parents[1] / "data" / "vehicles" / "hovering.yaml"))
DIVE = Dive("dive-7", Path("dive.tlog"), "1" * 64)


def method(mass, ends=""):
    """An estimator that finds this mass in surge, and reports half way and at its end."""

    def estimate(*given):
        progress = given[-1]
        progress(0.5, "climbing")
        progress(1.0, ends)
        return fitted.fit({"M_u": mass, "D_u": 50.0}, 1e-4 * np.eye(2), method="made")

    return estimate


def refuses(dive, *_):
    raise FitError("no thruster pushed", of=dive.name)


def test_the_first_method_answers_and_a_second_that_disagrees_casts_a_doubt():
    identified = identify(DIVE, FILE, "hovering", {"a": method(100.0), "b": method(150.0)})
    assert identified.answer["M_u"].value == 100.0
    assert identified.answer.outcome is Outcome.DISAGREES
    assert [doubt.about for doubt in identified.answer.doubts] == [("M_u",)]
    (comparison,) = identified.comparisons
    assert comparison.second["M_u"].value == 150.0


def test_every_method_reports_its_steps_and_at_last_its_values():
    steps = []
    identify(DIVE, FILE, "hovering", {"a": method(100.0, "the loss fell no more")}, steps.append)
    assert [(step.of, step.share, step.answered) for step in steps] == [
        ("a", 0.5, False), ("a", 0.99, False), ("a", 1.0, True),
    ]  # fmt: skip
    assert steps[-1].words == ANSWERED
    assert steps[-1].values["M_u"][0] == 100.0


def test_how_a_method_ended_is_a_note_unless_it_is_only_done():
    ended = identify(DIVE, FILE, "hovering", {"a": method(100.0, "the loss fell no more")}).answer
    done = identify(DIVE, FILE, "hovering", {"a": method(100.0)}).answer
    assert "The loss fell no more." in ended.notes
    assert len(ended.notes) == len(done.notes) + 1


def test_a_dive_that_tells_nothing_gives_an_answer_with_the_reason_once():
    answer = identify(DIVE, FILE, "hovering", {"a": refuses}).answer
    assert answer.outcome is Outcome.NOT_IDENTIFIABLE
    assert answer.values() == {}
    assert answer["M_u"].reason == "no thruster pushed"


def test_the_first_run_compiles_and_later_ones_find_what_it_kept(tmp_path, monkeypatch):
    kernel = SimpleNamespace(__module__="identify.estimators.filter.information")
    kept = SimpleNamespace(stats=SimpleNamespace(cache_path=str(tmp_path)), py_func=kernel)
    monkeypatch.setattr(information, "gradient_and_information", kept)
    assert compiles_first()
    (tmp_path / "information.gradient_and_information-50.py311.nbi").write_bytes(b"")
    assert not compiles_first()
