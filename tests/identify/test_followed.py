"""The curves of a dive: few points, true to the recording, honest where it has gaps."""

import json
from dataclasses import replace

import numpy as np
import pytest
from test_validate import dive

from identify.dive import Signal
from identify.glance.following import Followed, followed


def test_only_axes_that_the_reference_moves_along_have_curves() -> None:
    (surge,) = followed(dive())
    assert (surge.axis, surge.unit, surge.wrench_unit) == ("surge", "m/s", "N")


def test_curves_are_means_of_what_was_recorded() -> None:
    (surge,) = followed(dive(offset_m_s=-0.02), points=100)
    assert len(surge.time_s) in (99, 100)
    assert surge.measured - surge.reference == pytest.approx(np.full(len(surge.time_s), -0.02), abs=1e-12)
    assert surge.tau_pid == pytest.approx(np.full(len(surge.time_s), -5.0))
    assert surge.tau_ff == pytest.approx(np.full(len(surge.time_s), 3.0))
    assert np.diff(surge.time_s) == pytest.approx(np.full(len(surge.time_s) - 1, 40 / 100), rel=0.01)


def test_the_dvl_is_carried_to_the_origin() -> None:
    whole = dive()
    assert whole.gyro is not None
    turning = whole.gyro.value + np.array([0.0, 0.0, 0.1])
    (surge,) = followed(replace(whole, gyro=Signal(whole.gyro.time_s, turning)), (0.0, 0.5, 0.0))
    # A transducer half a metre to starboard runs 0.05 m/s slower than a body that turns to starboard.
    assert surge.measured - surge.reference == pytest.approx(np.full(len(surge.time_s), 0.05), abs=1e-9)


def test_a_gap_stays_a_gap_and_a_slow_signal_is_held() -> None:
    whole = dive()
    assert whole.velocity is not None
    value = whole.velocity.value.copy()
    out = (whole.velocity.time_s > 12.0) & (whole.velocity.time_s < 16.0)
    value[out] = np.nan
    (surge,) = followed(replace(whole, velocity=Signal(whole.velocity.time_s, value)), points=400)
    assert np.isnan(surge.measured[(surge.time_s > 12.2) & (surge.time_s < 15.8)]).all()
    slow = Signal(whole.velocity.time_s[::10], whole.velocity.value[::10])
    (held,) = followed(replace(whole, velocity=slow), points=400)
    assert np.isfinite(held.measured).all()


def test_what_was_not_recorded_is_unknown_and_a_dive_without_reference_has_no_curves() -> None:
    (surge,) = followed(replace(dive(), tau_ff=None))
    assert np.isnan(surge.tau_ff).all()
    assert followed(replace(dive(), nu_ref=None)) == ()


def test_they_are_written_in_few_digits() -> None:
    (surge,) = followed(dive(offset_m_s=1 / 3), points=50)
    data = surge.to_json()
    assert data["measured"][0] == 0.3333
    assert data["step_s"] == pytest.approx(0.8, rel=0.01)
    assert len(data["reference"]) == len(surge.time_s)
    (surge,) = followed(replace(dive(), tau_pid=None), points=50)
    assert set(surge.to_json()["tau_pid"]) == {None}


def test_what_was_written_is_read_back_and_a_gap_stays_one() -> None:
    whole = dive(offset_m_s=1 / 3)
    assert whole.velocity is not None
    value = whole.velocity.value.copy()
    value[len(value) // 2 :] = np.nan
    (surge,) = followed(replace(whole, velocity=Signal(whole.velocity.time_s, value)), points=50)
    again = Followed.from_json(json.loads(json.dumps(surge.to_json())))
    assert (again.axis, again.unit, again.wrench_unit) == ("surge", "m/s", "N")
    assert again.time_s == pytest.approx(surge.time_s)
    assert again.tau_pid == pytest.approx(surge.tau_pid)
    assert again.measured == pytest.approx(surge.measured, abs=1e-3, nan_ok=True)
    assert np.isnan(again.measured).any()
