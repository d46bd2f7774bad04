"""Where a gap lies: the degree of freedom, the phase and the speed, in the words of a diagnosis."""

from dataclasses import replace

import pytest
from made_diagnoses import UNKNOWN, diagnosis, gap, read

from identify.diagnose import wording_verdict
from identify.diagnose.result import Share, Slice

pytestmark = pytest.mark.usefixtures("sketched")


def test_no_speed_is_named_below_which_a_vehicle_counts_as_at_rest():
    def above(low: float) -> str:
        slices = (Slice("surge", "speed", 0.0, low, 0.01), Slice("surge", "speed", low, 0.6, 0.82))
        return wording_verdict.where_sentence(replace(gap(), slices=slices))

    assert above(0.057).endswith("in surge, steady, mostly above 0.06 m/s")
    assert above(0.0041).endswith("in surge, steady")


def test_of_what_no_candidate_explains_it_is_told_where_that_lies_and_not_where_the_whole_gap_does():
    left = replace(gap(), unexplained_where=(Share("yaw", "turning", 1.0),))
    said = wording_verdict.verdict_sentence(diagnosis(verdict="unknown", character=UNKNOWN, gap=left))
    assert said.startswith("Something is there that no candidate explains: 100 % of it is in yaw, turning; ")


def test_a_gap_that_is_spread_is_told_by_its_degree_of_freedom():
    spread = tuple(
        Share(dof, phase, share)
        for dof, phase, share in (
            ("surge", "steady", 0.35),
            ("surge", "turning", 0.25),
            ("sway", "steady", 0.4 - 1e-9),
        )
    )
    where = wording_verdict.where_sentence(replace(gap(), where=spread, slices=()))
    assert where == "60 % of it is in surge, most of that steady"


def test_a_degree_of_freedom_that_drifts_most_without_the_most_force_is_named():
    assert wording_verdict.where_note(gap()) == ""
    sway = replace(gap(), where=(Share("sway", "steady", 0.8), Share("surge", "steady", 0.2)))
    drifted = (Share("surge", "turning", 0.6), Share("sway", "steady", 0.3), Share("surge", "rest", 0.1))
    sway = replace(sway, drifted=drifted)
    assert wording_verdict.where_note(sway).startswith(
        "By drift it is another: 70 % of what the squared 5 s drift is beyond noise, in floors, is in surge."
    )
    assert wording_verdict.verdict_sentence(diagnosis(gap=sway, check=None)).startswith(
        "Quadratic drag explains the gap: by drift 60 % of it is in surge, turning (by force 80 % of it is in sway, "
        "steady); with it the model's"
    )
    assert "by drift" not in wording_verdict.verdict_sentence(
        diagnosis(gap=replace(sway, drifted=sway.where))
    )
    assert "What is shared out is force, not drift" in read(diagnosis())
    assert "By drift it is another" in read(diagnosis(gap=sway))
    assert wording_verdict.where_note(replace(sway, before=1.1)) == ""


def test_most_is_not_said_of_what_is_no_more_than_half():
    shares = (
        ("surge", "steady", 0.19),
        ("surge", "turning", 0.15),
        ("surge", "rest", 0.06),
        ("yaw", "steady", 0.3),
    )
    rest = Share("sway", "steady", 0.3)
    spread = (*(Share(dof, phase, share) for dof, phase, share in shares), rest)
    where = wording_verdict.where_sentence(replace(gap(), where=spread, slices=()))
    assert where == "40 % of it is in surge, the largest part of that steady"


def test_speed_is_not_named_where_the_gap_does_not_go_with_it():
    even = tuple(Slice("surge", "speed", 0.2 * k, 0.2 * (k + 1), 0.3) for k in range(3))
    assert wording_verdict.where_sentence(replace(gap(), slices=even)).endswith("in surge, steady")


def test_the_largest_parts_come_first_and_nothing_is_named_that_rounds_to_none():
    assert wording_verdict.where_lines(diagnosis()) == (
        "71 % surge, steady",
        "15 % sway, turning",
        "12 % surge, accelerating",
    )
    tiny = replace(gap(), where=(Share("surge", "rest", 0.998), Share("yaw", "rest", 0.002)))
    assert wording_verdict.where_lines(diagnosis(gap=tiny)) == ("100 % surge, at rest",)


def test_a_depth_that_stays_the_same_is_not_sliced():
    still = replace(
        gap(), slices=tuple(Slice("surge", "depth", 0.6 + 1e-4 * k, 0.6001 + 1e-4 * k, 0.3) for k in range(3))
    )
    assert "0.60 to 0.60" not in read(diagnosis(gap=still))


@pytest.mark.usefixtures("rendered")
def test_slices_are_in_the_units_of_what_they_slice_by():
    page = read(diagnosis())
    for told in ("0.30 to 0.60 m/s", "0° to 180°", "2.0 to 5.0 m", "5.0 to 7.5 m"):
        assert told in page


def test_a_slice_that_is_the_whole_says_nothing_and_is_not_shown():
    assert "voltage\n" not in read(diagnosis())
