"""Readings that stand still while the vehicle goes on are left out; what repeats by nature stays."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import closed_loop
import numpy as np
import pytest

from bench.missions.mission import draw_one
from bridge.errors import FitError
from identify.answer import answered
from identify.challenge.recording import tlog_of
from identify.checks.controller import frozen_doubts
from identify.checks.frozen import without_frozen
from identify.dive import Signal
from identify.estimators.likelihood import estimate
from identify.ingest.open import read_dive

SHARED = Path(__file__).resolve().parents[2].parent / "shared"
FILE = closed_loop.vehicle_file()


def quiet(*_told):
    """Nobody listens."""


@cache
def dive(**keys):
    return closed_loop.dive(np.random.default_rng(100_001), seconds=200.0, **keys)


def stuck(signal, *stretches):
    """The signal at its first value in each stretch, from and to in s."""
    value = signal.value.copy()
    for start_s, end_s in stretches:
        held = (signal.time_s >= start_s) & (signal.time_s < end_s)
        value[held] = value[held][0]
    return Signal(signal.time_s, value)


def with_stuck_velocity(*stretches):
    return replace(dive(), velocity=stuck(dive().velocity, *stretches))


def test_a_velocity_that_stands_still_is_left_out_but_for_its_first_reading_and_told():
    found = without_frozen(with_stuck_velocity((50.0, 110.0)))
    assert found.frozen == {"velocity": (pytest.approx((50.0, 109.9)),)}
    assert len(found.velocity) == 2000 - 599
    (note,) = found.notes
    assert note.startswith(
        "The velocity repeats one value for 60 s (29.9 % of its readings) while the vehicle goes on"
    )


def test_mass_is_right_again_once_the_stuck_velocity_is_out():
    recorded = with_stuck_velocity((50.0, 110.0), (130.0, 160.0))
    assert abs(estimate(recorded, FILE, "only", quiet)["M_u"].value / closed_loop.MASS - 1) > 0.3
    mass = estimate(without_frozen(recorded), FILE, "only", quiet)["M_u"]
    assert mass.low95 < closed_loop.MASS < mass.high95


def test_a_controller_that_went_on_with_another_velocity_is_warned_of():
    found = without_frozen(with_stuck_velocity((50.0, 110.0)))
    (doubt,) = frozen_doubts(found)
    assert doubt.about == ("M_u", "D_u")
    assert doubt.sentence.startswith("For 60 s (30.0 % of the dive) the recorded velocity stood still")
    assert "the logged velocity can't be the one that the controller used" in doubt.sentence
    whole = answered(estimate(found, FILE, "only", quiet), found, FILE)
    assert doubt in whole.doubts


def test_a_controller_that_had_nothing_but_the_stuck_velocity_is_not():
    recorded = with_stuck_velocity((50.0, 110.0))
    found = without_frozen(replace(recorded, nu_fb=stuck(recorded.nu_fb, (50.0, 110.0))))
    assert found.frozen["velocity"]
    assert frozen_doubts(found) == ()


def test_a_stuck_velocity_carried_to_the_origin_by_the_gyro_is_no_other_velocity():
    recorded = with_stuck_velocity((50.0, 110.0))
    used = stuck(recorded.nu_fb, (50.0, 110.0)).value
    used[:, 5] = 0.2 * np.sin(recorded.nu_fb.time_s)
    used[:, 0] += 0.4 * used[:, 5]
    found = without_frozen(replace(recorded, nu_fb=Signal(recorded.nu_fb.time_s, used)))
    assert frozen_doubts(found) == ()


def test_a_short_stretch_in_steady_speed_is_told_by_the_noise_that_is_missing():
    recorded = replace(with_stuck_velocity((60.0, 63.0)), nu_fb=None)
    held = replace(recorded, tau_cmd=Signal(recorded.tau_cmd.time_s, np.full((2000, 6), 20.0)))
    assert without_frozen(held).frozen == {"velocity": (pytest.approx((60.0, 62.9)),)}


def test_a_dropout_shorter_than_two_seconds_is_left_alone():
    recorded = with_stuck_velocity((60.0, 61.9))
    assert without_frozen(recorded) is recorded


@pytest.mark.parametrize("times", [2, 5, 10])
def test_readings_that_are_passed_on_faster_than_they_are_read_stay(times):
    slow = dive().velocity
    time_s = np.arange(len(slow) * times) * 0.1 / times
    often = Signal(time_s, np.repeat(slow.value, times, axis=0))
    recorded = replace(dive(), velocity=often)
    assert without_frozen(recorded) is recorded


@pytest.mark.parametrize("step", [1e-3, 1e-2])
def test_a_vehicle_without_noise_keeps_its_readings_at_rest_and_at_steady_speed(step):
    """Nothing disturbs it, and its sensor reads in steps: at rest and at full speed one value holds for seconds."""
    still = dive(noise=0.0, disturbance=0.0)
    value = step * np.round(still.velocity.value / step)
    fed = still.nu_fb.value.copy()
    fed[:, 0] = value[:, 0]
    recorded = replace(
        still, velocity=Signal(still.velocity.time_s, value), nu_fb=Signal(still.nu_fb.time_s, fed)
    )
    runs = np.diff(np.flatnonzero(np.diff(value[:, 0], prepend=1.0, append=1.0)))
    assert runs.max() > 20
    assert without_frozen(recorded) is recorded


def test_a_vehicle_that_lies_still_without_thrust_keeps_what_repeats():
    recorded = with_stuck_velocity((50.0, 110.0))
    idle = recorded.tau_cmd.value.copy()
    idle[500:1100] = 0.0
    resting = replace(recorded, tau_cmd=Signal(recorded.tau_cmd.time_s, idle), nu_fb=None)
    assert without_frozen(resting) is resting


@pytest.mark.parametrize(("name", "said"), [("gyro", "gyro"), ("attitude", "attitude"), ("depth", "depth")])
def test_every_sensor_that_stands_still_is_named(name, said):
    mission = draw_one(100_002, seconds=60.0, kind="rocking")
    signal = getattr(mission.dive, name)
    found = without_frozen(replace(mission.dive, **{name: stuck(signal, (20.0, 40.0))}))
    assert list(found.frozen) == [name]
    assert said in found.notes[0]
    assert len(getattr(found, name)) < 0.7 * len(signal)
    assert without_frozen(mission.dive) is mission.dive


def test_a_dive_in_which_all_stands_still_is_refused_in_a_sentence():
    found = without_frozen(with_stuck_velocity((0.0, 200.0)))
    assert found.velocity is None
    with pytest.raises(
        FitError, match="every velocity and rate of turn in it repeats one value while the thrusters"
    ):
        estimate(found, FILE, "only", quiet)


def test_an_axis_whose_sensor_stood_still_throughout_says_so():
    mission = draw_one(100_002, seconds=40.0, kind="rocking")
    all_along = stuck(mission.dive.velocity, (0.0, 100.0))
    found = estimate(
        without_frozen(replace(mission.dive, velocity=all_along)), mission.file, mission.configuration, quiet
    )
    assert (
        found["M_u"].reason
        == "the recorded velocity in surge stands still at one value while the vehicle goes on; check the DVL, and "
        "what passes its readings on"
    )


def test_reading_a_recording_leaves_out_what_stands_still_and_the_file_as_it_is(tmp_path):
    mission = draw_one(100_002, seconds=60.0, kind="rocking")
    log = tmp_path / "dive.tlog"
    log.write_bytes(tlog_of(replace(mission.dive, velocity=stuck(mission.dive.velocity, (20.0, 40.0)))))
    before = log.read_bytes()
    found = read_dive(log)
    ((start_s, end_s),) = found.frozen["velocity"]
    assert end_s - start_s == pytest.approx(20.0, abs=0.5)
    assert any("The velocity repeats one value for 20 s" in note for note in found.notes)
    assert log.read_bytes() == before


@pytest.mark.parametrize(
    "name", ["sealed/open_1/dive.tlog.gz", "data/ardusub_sitl/still.tlog.gz", "data/ardusub_dives/small.tlog"]
)
def test_recordings_made_elsewhere_lose_nothing(name):
    if not (SHARED / name).exists():
        pytest.skip(f"needs ../shared/{name} beside the checkout")
    assert read_dive(SHARED / name).frozen == {}


def test_a_velocity_that_stood_still_for_most_of_a_dive_leaves_the_mass_to_the_rest():
    found = without_frozen(with_stuck_velocity((20.0, 80.0), (120.0, 190.0)))
    mass = answered(estimate(found, FILE, "only", quiet), found, FILE)["M_u"]
    assert mass.low95 < closed_loop.MASS < mass.high95
    assert mass.identifiable


def test_one_axis_that_stands_still_alone_is_left_out_there_and_told():
    whole = draw_one(100_002, seconds=60.0, kind="rocking").dive
    read = whole.velocity
    alone = stuck(Signal(read.time_s, read.value[:, :1]), (20.0, 40.0))
    value = np.column_stack([alone.value, read.value[:, 1:]])
    found = without_frozen(replace(whole, velocity=Signal(read.time_s, value)))
    assert list(found.frozen) == ["velocity in surge"]
    (note,) = found.notes
    assert note.startswith("The velocity in surge repeats one value for 20 s")
    held = (read.time_s > 20.2) & (read.time_s < 39.8)
    assert np.isnan(found.velocity.value[held, 0]).all()
    assert np.array_equal(found.velocity.value[:, 1:], read.value[:, 1:], equal_nan=True)


def test_a_controller_whose_velocity_went_on_in_the_frozen_axis_is_warned_of_that_axis_alone():
    recorded = replace(dive(), velocity=with_moving_sway(with_stuck_velocity((50.0, 110.0)).velocity))
    found = without_frozen(recorded)
    assert list(found.frozen) == ["velocity in surge"]
    (doubt,) = frozen_doubts(found)
    assert doubt.about == ("M_u", "D_u")


def with_moving_sway(velocity):
    value = velocity.value.copy()
    value[:, 1] = 0.004 * np.random.default_rng(1).standard_normal(len(value))
    return Signal(velocity.time_s, value)


@pytest.mark.parametrize("step", [0.01, 0.05])
def test_an_axis_that_rests_within_one_step_of_its_sensor_stays(step):
    value = with_moving_sway(dive().velocity).value
    value[:1000, 1] += 0.4 * np.sin(dive().velocity.time_s[:1000])
    value[:, 1] = step * np.round(value[:, 1] / step)
    recorded = replace(dive(), velocity=Signal(dive().velocity.time_s, value))
    assert without_frozen(recorded) is recorded
