"""What is said of a second method beside the first: how it ended, what it alone doubts, why it gives no value."""

import fitted
import numpy as np

from identify.comparison import compare
from identify.identification import Doubt, Outcome
from identify.report.compared import comparison_section, told_beside

SURGE = {"M_u": 100.0, "D_u": 50.0}
SHARED = Doubt(("M_u",), "The DVL was late", "dive again.")
OWN = Doubt(("D_u",), "The loss still fell", "dive longer.", Outcome.DISAGREES)


def by(method, values=SURGE, std=0.01, **keys):
    return fitted.fit(values, std**2 * np.eye(len(values)), method=method, **keys)


def test_of_two_that_converged_with_the_same_values_nothing_more_is_said():
    assert told_beside(compare(by("likelihood", doubts=(SHARED,)), by("pinn", doubts=(SHARED,)))) == ()


def test_a_second_that_did_not_converge_says_so_and_what_it_alone_doubts():
    second = by("pinn", outcome=Outcome.DISAGREES, doubts=(SHARED, OWN))
    assert told_beside(compare(by("likelihood", doubts=(SHARED,)), second)) == (
        "Pinn ended with 'data and model disagree'.",
        "Pinn: The loss still fell: dive longer.",
    )


def drag(score, axis="surge"):
    return Doubt(("M_u", "D_u"), f"In {axis} a drag is missing ({score} standard errors)", "dive slower.")


def test_a_doubt_of_both_that_differs_by_a_figure_is_not_said_again_and_another_of_the_same_coefficients_is():
    late = Doubt(("M_u", "D_u"), "In surge thrust is late by 20 ms", "mend the lag.")
    assert told_beside(compare(by("likelihood", doubts=(drag(9),)), by("pinn", doubts=(drag(8),)))) == ()
    assert told_beside(compare(by("likelihood", doubts=(late,)), by("pinn", doubts=(drag(8),)))) == (
        "Pinn: In surge a drag is missing (8 standard errors): dive slower.",
    )


def test_what_one_alone_gives_no_value_of_stands_with_its_reason():
    found = compare(by("likelihood", {"M_u": 100.0, "M_v": 110.0}), by("pinn"))
    assert told_beside(found) == (
        f"Likelihood gives no D_u: {fitted.NOT_DIVED}",
        f"Pinn gives no M_v: {fitted.NOT_DIVED}",
    )


def test_a_second_that_gives_nothing_says_why_once_and_a_first_has_said_it_already():
    ended = {"outcome": Outcome.NOT_IDENTIFIABLE}
    found = compare(by("likelihood"), by("pinn", {}, **ended))
    assert told_beside(found) == (
        "Pinn ended with 'not identifiable'.",
        f"Pinn gives nothing: {fitted.NOT_DIVED}",
    )
    assert told_beside(compare(by("likelihood", {}, **ended), by("pinn"))) == ()


def test_the_page_says_it_whether_or_not_the_methods_disagree():
    for mass in (100.0, 130.0):
        found = compare(by("likelihood"), by("pinn", {"M_u": mass}, outcome=Outcome.AT_BOUND))
        section = comparison_section(found)
        assert bool(section.warning) is (mass > 100.0)
        assert "Pinn ended with 'stopped at a bound'." in section.text
        assert f"Pinn gives no D_u: {fitted.NOT_DIVED}" in section.text
