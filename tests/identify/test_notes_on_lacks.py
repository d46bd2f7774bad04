"""What the notes on seldom commands and on unknown velocities say is true of the recording."""

from pathlib import Path

import numpy as np
import pytest

from identify.checks.readings.missing_signals import missing_signals
from identify.dive import Dive, Signal


@pytest.mark.parametrize(
    ("rate_hz", "asked"), [(10.0, "at 20 Hz or more"), (25.0, "as often as that loop runs")]
)
def test_samples_of_a_faster_loop_are_asked_for_more_often_than_they_came(rate_hz, asked):
    times = np.arange(0.0, 40.0, 1.0 / rate_hz)
    pulses = Signal(times, 1500.0 + 200.0 * np.sin(np.outer(times, [0.5, 0.7])))
    dive = Dive("dive", Path("dive.BIN"), "", pwm=pulses, commands_hold=False)
    (note,) = (each for each in missing_signals(dive) if each.startswith("Thruster commands come"))
    assert note.endswith(f"Record them {asked}.")


@pytest.mark.parametrize(
    ("axes", "said"), [([0, 1, 2], "no bottom lock in 25 %"), ([2], "In 25 % of the velocities some")]
)
def test_a_velocity_that_lacks_an_axis_in_some_rows_is_not_told_to_be_without_bottom_lock(axes, said):
    times = np.arange(0.0, 40.0, 0.1)
    velocity = Signal(times, np.sin(np.outer(times, [0.5, 0.7, 0.9])))
    velocity.value[np.ix_(range(0, 400, 4), axes)] = np.nan
    dive = Dive("dive", Path("dive.csv"), "", velocity=velocity)
    (note,) = (each for each in missing_signals(dive) if "%" in each)
    assert said in note
