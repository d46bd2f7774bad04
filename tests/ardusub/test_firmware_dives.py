"""Dives with the firmware in the loop: recorded by the companion, identified and diagnosed."""

import sys

import pytest
from fakes.firmware import binary

from bench.ardusub.page import measured

pytestmark = pytest.mark.soak


def test_mass_and_drag_are_identified_within_5_percent_and_inside_their_intervals(tmp_path):
    figures = measured(binary(), tmp_path, "plain")
    sys.stderr.write(f"\n{figures}\n")
    for name, axis in figures.items():
        for true, value, low, high in (axis["mass"], axis["drag"]):
            # The autopilot's gyro comes filtered, late: in yaw the interval alone has to hold.
            assert name == "yaw" or value == pytest.approx(true, rel=0.05)
            assert low <= true <= high


@pytest.mark.parametrize(
    ("case", "cause"),
    [
        ("half", "weak_thruster"),
        ("delay", "command_delay"),
        ("current", "steady_current"),
        ("tether", "tether"),
    ],
)
def test_what_is_planted_is_named(tmp_path, case, cause):
    figures = measured(binary(), tmp_path, case)
    sys.stderr.write(f"\n{figures}\n")
    assert any(named.startswith(cause) for named in figures["causes"])
    if case == "half":
        assert figures["after"] == {"verdict": "no_gap", "causes": []}
