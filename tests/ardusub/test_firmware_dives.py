"""Dives with the firmware in the loop: recorded by the companion, identified and diagnosed."""

import sys

import pytest
from fakes.firmware import firmware_path

from bench.ardusub.page import measured

pytestmark = pytest.mark.soak


def test_mass_and_drag_are_identified_within_5_percent_and_inside_their_intervals_and_no_gap_is_told(
    tmp_path,
):
    figures = measured(firmware_path(), tmp_path, "plain")
    sys.stderr.write(f"\n{figures}\n")
    holding = []
    for axis in figures["axes"].values():
        for true, value, _, _ in (*axis["mass"], *axis["drag"]):
            assert value == pytest.approx(true, rel=0.05)
        holding += [low <= true <= high for true, _, low, high in (*axis["mass"], *axis["drag"])]
    # Of 40 intervals of 95 %, 34 hold at least, but for one time in 300.
    assert sum(holding) >= 34
    assert [answer["verdict"] for answer in figures["answers"]] == ["no_gap"] * 5


@pytest.mark.parametrize(
    ("case", "cause"),
    [
        ("half", "weak_thruster"),
        ("delay", "command_delay"),
        ("current", "steady_current"),
        ("tether", "tether"),
        ("waves", "waves"),
    ],
)
def test_what_is_planted_is_named_and_gone_in_the_next_dive(tmp_path, case, cause):
    """Waves are of one dive alone: the next has its own, and nothing else."""
    figures = measured(firmware_path(), tmp_path, case)
    sys.stderr.write(f"\n{figures}\n")
    assert any(named.startswith(cause) for named in figures["causes"])
    if case == "waves":
        (again,) = figures["after"]["causes"]
        assert again.startswith(cause)
    else:
        assert figures["after"] == {"verdict": "no_gap", "causes": []}
