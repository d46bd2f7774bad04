"""A check dive on which the gap does not close by what was foretold is told of, beside a verdict that names causes."""

import math

import pytest

from identify.diagnose.result import Shrink
from identify.diagnose.shrink import contradicted, contradiction_clause, contradiction_note

NAN = math.nan
FORETOLD = Shrink(3.0, 1.04, 0.98, 0.95, 1.0)


def measured(value: float, low: float, high: float, before: float = 3.0) -> Shrink:
    return Shrink(before, before - value * (before - 1.0), value, low, high)


@pytest.mark.parametrize(
    ("check", "speaks_against"),
    [
        (measured(0.97, 0.9, 1.0), False),
        (measured(0.6, 0.5, 0.7), False),
        (measured(0.11, 0.02, 0.2), True),
        (measured(0.0, -0.02, 0.02), True),
        (measured(-0.8, -1.2, -0.5), True),
        (measured(0.3, -0.5, 0.96), False),
        (Shrink(1.02, 1.05, NAN, NAN, NAN), False),
        (Shrink(1.02, 1.6, NAN, NAN, NAN), True),
        (None, False),
    ],
)
def test_it_is_contradicted_by_less_than_half_of_it_beyond_chance(
    check: Shrink | None, speaks_against: bool
) -> None:
    assert contradicted(FORETOLD, check) == speaks_against
    assert (
        bool(contradiction_clause(FORETOLD, check))
        == bool(contradiction_note(FORETOLD, check))
        == speaks_against
    )


def test_what_foretells_nothing_is_not_contradicted_by_a_gap_that_stays() -> None:
    assert not contradicted(None, measured(0.0, -0.1, 0.1))
    assert not contradicted(Shrink(1.0, 1.0, NAN, NAN, NAN), measured(0.0, -0.1, 0.1))


def test_the_clause_tells_both_shares_and_the_note_what_to_do() -> None:
    assert contradiction_clause(FORETOLD, measured(0.11, 0.02, 0.2)) == (
        ", but the check dive does not bear that out (98 % of what can be closed was foretold to close there, and 11 % "
        "does)"
    )
    assert "and none does)" in contradiction_clause(FORETOLD, measured(-0.8, -1.2, -0.5))
    worse = Shrink(1.02, 1.6, NAN, NAN, NAN)
    assert "with the causes its 5 s drift is 1.6 floors, without them 1.0" in contradiction_clause(
        FORETOLD, worse
    )
    (sentence,) = contradiction_note(FORETOLD, worse)
    assert "same vehicle and configuration" in sentence
