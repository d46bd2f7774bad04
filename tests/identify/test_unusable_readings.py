"""Unusable readings are left out or doubted: NaN commands, frozen or repeated readings, flips, loud noise."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import closed_loop
import numpy as np
import pytest
from built_recordings import of_table
from fakes.planted import quiet
from fakes.shared import shared

from bench.missions.mission import draw_one
from bridge.errors import FitError
from bridge.vehicle.config import CONFIGS
from bridge.vehicle.thrusters import thrust_curve
from identify.challenge.tlog import tlog_of
from identify.checks.actuation.controller import frozen_doubts
from identify.checks.fit.loud_noise import Loud, loud, loud_doubts, loud_note
from identify.checks.fit.missing_forces import why_not_identifiable
from identify.checks.readings.copies import without_copies
from identify.checks.readings.frozen import without_frozen
from identify.checks.readings.impossible import without_impossible, without_repeated
from identify.checks.readings.missing_signals import missing_signals
from identify.dive import Dive, Signal
from identify.doubt import Outcome
from identify.estimators.answer import answered
from identify.estimators.axes.build import build_axes
from identify.estimators.likelihood.answer import estimate
from identify.estimators.likelihood.fit import fit_axes
from identify.ingest.commands import with_known_commands
from identify.ingest.files.text_table import read_table
from identify.ingest.mapping.column_map import column_map
from identify.ingest.mapping.profiles import profiles
from identify.ingest.open import read_dive
from identify.thrust.wrench import wrench

FILE = closed_loop.vehicle_file()


def dive_by_pulses(seconds=200.0):
    """The closed loop with its thrust as pulse widths of one thruster, and no wrench recorded."""
    whole = closed_loop.dive(np.random.default_rng(100_003), seconds=seconds)
    force = whole.tau_cmd.value[:, :1]
    curve = FILE.vehicle.thrust_curve
    pulses = np.linspace(1100.0, 1900.0, 8001)
    thrust = thrust_curve(curve, CONFIGS / "thrusters").thrust(pulses)
    us = np.interp(force[:, 0], thrust, pulses)
    return replace(whole, tau_cmd=None, pwm=Signal(whole.tau_cmd.time_s, us[:, None]))


def with_unknown_commands(dive, lacking):
    value = dive.pwm.value.copy()
    value[lacking] = np.nan
    return replace(dive, pwm=Signal(dive.pwm.time_s, value))


def test_a_few_commands_that_are_no_number_leave_the_mass_right_and_are_told():
    dive = dive_by_pulses()
    spoilt = with_unknown_commands(dive, np.random.default_rng(4).random(len(dive.pwm)) < 0.02)
    cleaned = with_known_commands(spoilt)
    assert np.isfinite(cleaned.pwm.value).all()
    assert cleaned.duration_s == spoilt.duration_s
    (note,) = cleaned.notes
    assert "are no number in output 1: the command before holds for up to 0.5 s" in note
    mass = estimate(cleaned, FILE, "only", quiet)["M_u"]
    assert mass.value == pytest.approx(closed_loop.MASS, rel=0.05)


def test_an_unknown_stretch_leaves_the_longest_known_part():
    dive = dive_by_pulses()
    time_s = dive.pwm.time_s
    cleaned = with_known_commands(with_unknown_commands(dive, (time_s > 79.95) & (time_s < 85.0)))
    assert np.isfinite(cleaned.pwm.value).all()
    assert cleaned.span_s[0] == pytest.approx(85.0)
    assert cleaned.notes[-1].startswith(
        "Before its first number, or for more than 0.5 s, the command in output 1 is unknown: only the longest part "
    )
    assert "in which all are known is used, 115 s of 200 s" in cleaned.notes[-1]


def test_an_output_that_is_no_number_all_the_dive_is_named_and_nothing_is_cut():
    dive = dive_by_pulses()
    never = with_unknown_commands(dive, np.ones(len(dive.pwm), bool))
    cleaned = with_known_commands(never)
    assert cleaned.notes == ("Output 1 is no number all the dive: what was asked of a thruster is unknown.",)
    assert cleaned.duration_s == never.duration_s
    with pytest.raises(FitError, match="neither thruster commands that fit the vehicle nor wrenches"):
        wrench(cleaned, FILE, "only")
    tau = Signal(dive.pwm.time_s, np.zeros((len(dive.pwm), 6)))
    assert wrench(replace(cleaned, tau_cmd=tau), FILE, "only").asked == pytest.approx(0.0)


def test_outputs_that_drive_no_thruster_may_be_unknown():
    dive = dive_by_pulses()
    light = np.column_stack([dive.pwm.value, np.full(len(dive.pwm), np.nan)])
    recorded = replace(dive, pwm=Signal(dive.pwm.time_s, light))
    assert with_known_commands(recorded, 1) is recorded


def test_a_command_holds_for_so_long_and_no_longer():
    time_s = np.array([0.0, 0.2, 0.5, 1.0, 1.4, 2.0])
    value = np.array([1600.0, np.nan, 1700.0, 1650.0, np.nan, 1550.0])
    cleaned = with_known_commands(Dive("d", Path("d"), "", pwm=Signal(time_s, value[:, None])))
    assert cleaned.pwm.value[:, 0].tolist() == [1600.0, 1600.0, 1700.0, 1650.0]


@pytest.mark.parametrize("wild", [1e30, -25.0, np.inf])
def test_one_reading_that_no_vehicle_can_have_made_is_left_out_and_told(wild):
    dive = closed_loop.dive(np.random.default_rng(100_003), seconds=100.0)
    value = dive.velocity.value.copy()
    value[500, 0] = wild
    cleaned = without_impossible(replace(dive, velocity=Signal(dive.velocity.time_s, value)))
    assert len(cleaned.velocity) == len(dive.velocity) - 1
    (note,) = cleaned.notes
    assert note.startswith(
        "1 reading of the velocity (0.1 %) is beyond 20 m/s, which no vehicle reaches: it is left out"
    )


def test_an_output_that_says_that_it_is_none_is_unknown():
    dive = dive_by_pulses()
    value = dive.pwm.value.copy()
    value[3] = 65535.0
    assert np.isnan(without_impossible(replace(dive, pwm=Signal(dive.pwm.time_s, value))).pwm.value[3, 0])


def test_an_honest_dive_is_left_as_it_is():
    dive = dive_by_pulses()
    assert with_known_commands(without_impossible(dive)) is dive


@pytest.mark.parametrize("name", ["ff_mode", "veh_cfg"])
def test_a_mode_or_configuration_that_is_no_whole_number_is_left_out_and_told(name):
    signal = Signal(np.arange(5.0), np.array([[np.nan], [1.0], [np.inf], [0.5], [2.0]]))
    dive = replace(closed_loop.dive(np.random.default_rng(1), seconds=10.0), **{name: signal})
    cleaned = without_impossible(dive)
    assert cleaned.signals()[name].value[:, 0].tolist() == [1.0, 2.0]
    assert cleaned.signals()[name].time_s.tolist() == [1.0, 4.0]
    assert cleaned.notes[-1] == (
        f"{name.upper()} is no whole number in 60.0 % of what tells it: left out, as not said."
    )
    never = replace(dive, **{name: Signal(np.zeros(1), np.full((1, 1), np.nan))})
    assert name not in without_impossible(never).signals()


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
    cleaned = without_frozen(with_stuck_velocity((50.0, 110.0)))
    assert cleaned.frozen == {"velocity": (pytest.approx((50.0, 109.9)),)}
    assert len(cleaned.velocity) == 2000 - 599
    (note,) = cleaned.notes
    assert note.startswith(
        "The velocity repeats one value for 60 s (29.9 % of its readings) while the vehicle goes on"
    )


def test_a_controller_that_went_on_with_another_velocity_is_warned_of():
    cleaned = without_frozen(with_stuck_velocity((50.0, 110.0)))
    (doubt,) = frozen_doubts(cleaned)
    assert doubt.about == ("M_u", "D_u")
    assert doubt.sentence.startswith("For 60 s (30.0 % of the dive) the recorded velocity stood still")
    assert "the logged velocity can't be the one that the controller used" in doubt.sentence
    whole = answered(estimate(cleaned, FILE, "only", quiet), cleaned, FILE)
    assert doubt in whole.doubts


def test_a_controller_that_had_nothing_but_the_stuck_velocity_is_not():
    recorded = with_stuck_velocity((50.0, 110.0))
    cleaned = without_frozen(replace(recorded, nu_fb=stuck(recorded.nu_fb, (50.0, 110.0))))
    assert cleaned.frozen["velocity"]
    assert frozen_doubts(cleaned) == ()


@pytest.mark.parametrize(
    ("last_us", "thrusters", "pushed"),
    [
        pytest.param(0.0, None, False, id="an output without a pulse"),
        pytest.param(0.0, 8, False, id="a thruster without a pulse"),
        pytest.param(1100.0, 7, False, id="a light behind the thrusters of the vehicle file"),
        pytest.param(1100.0, 8, True, id="a thruster of the vehicle file"),
    ],
)
def test_a_sensor_may_stand_still_while_no_thruster_pushes(last_us, thrusters, pushed):
    recorded = with_stuck_velocity((50.0, 110.0))
    time_s = recorded.tau_cmd.time_s
    us = np.full((len(time_s), 8), 1500.0)
    us[:, 7] = last_us
    at_rest = replace(recorded, pwm=Signal(time_s, us), tau_cmd=None)
    assert ("velocity" in without_frozen(at_rest, thrusters=thrusters).frozen) == pushed


def test_a_short_stretch_in_steady_speed_is_told_by_the_noise_that_is_missing():
    recorded = replace(with_stuck_velocity((60.0, 63.0)), nu_fb=None)
    held = replace(recorded, tau_cmd=Signal(recorded.tau_cmd.time_s, np.full((2000, 6), 20.0)))
    assert without_frozen(held).frozen == {"velocity": (pytest.approx((60.0, 62.9)),)}


def test_a_dropout_shorter_than_two_seconds_is_left_alone():
    recorded = with_stuck_velocity((60.0, 61.9))
    assert without_frozen(recorded) is recorded


@pytest.mark.parametrize("times", [2, 10])
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


@pytest.mark.parametrize("name", ["gyro", "attitude", "depth"])
def test_every_sensor_that_stands_still_is_named(name):
    mission = draw_one(100_002, seconds=60.0, kind="rocking")
    signal = getattr(mission.dive, name)
    cleaned = without_frozen(replace(mission.dive, **{name: stuck(signal, (20.0, 40.0))}))
    assert list(cleaned.frozen) == [name]
    assert name in cleaned.notes[0]
    assert len(getattr(cleaned, name)) < 0.7 * len(signal)
    assert without_frozen(mission.dive) is mission.dive


def test_a_dive_in_which_all_stands_still_is_refused_in_a_sentence():
    cleaned = without_frozen(with_stuck_velocity((0.0, 200.0)))
    assert cleaned.velocity is None
    with pytest.raises(
        FitError, match="every velocity and rate of turn in it repeats one value while the thrusters"
    ):
        estimate(cleaned, FILE, "only", quiet)


def test_reading_a_recording_leaves_out_what_stands_still_and_the_file_as_it_is(tmp_path):
    mission = draw_one(100_002, seconds=60.0, kind="rocking")
    log = tmp_path / "dive.tlog"
    log.write_bytes(tlog_of(replace(mission.dive, velocity=stuck(mission.dive.velocity, (20.0, 40.0)))))
    before = log.read_bytes()
    recorded = read_dive(log)
    ((start_s, end_s),) = recorded.frozen["velocity"]
    assert end_s - start_s == pytest.approx(20.0, abs=0.5)
    assert any("The velocity repeats one value for 20 s" in note for note in recorded.notes)
    assert log.read_bytes() == before


@pytest.mark.parametrize(
    "name", ["sealed/open_1/dive.tlog.gz", "data/ardusub_sitl/still.tlog.gz", "data/ardusub_dives/small.tlog"]
)
def test_recordings_made_elsewhere_lose_nothing(name):
    assert read_dive(shared(name)).frozen == {}


def test_one_axis_that_stands_still_alone_is_left_out_there_and_told():
    whole = draw_one(100_002, seconds=60.0, kind="rocking").dive
    read = whole.velocity
    alone = stuck(Signal(read.time_s, read.value[:, :1]), (20.0, 40.0))
    value = np.column_stack([alone.value, read.value[:, 1:]])
    cleaned = without_frozen(replace(whole, velocity=Signal(read.time_s, value)))
    assert list(cleaned.frozen) == ["velocity in surge"]
    (note,) = cleaned.notes
    assert note.startswith("The velocity in surge repeats one value for 20 s")
    held = (read.time_s > 20.2) & (read.time_s < 39.8)
    assert np.isnan(cleaned.velocity.value[held, 0]).all()
    assert np.array_equal(cleaned.velocity.value[:, 1:], read.value[:, 1:], equal_nan=True)


def test_a_controller_whose_velocity_went_on_in_the_frozen_axis_is_warned_of_that_axis_alone():
    recorded = replace(dive(), velocity=with_moving_sway(with_stuck_velocity((50.0, 110.0)).velocity))
    cleaned = without_frozen(recorded)
    assert list(cleaned.frozen) == ["velocity in surge"]
    (doubt,) = frozen_doubts(cleaned)
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


COLUMNS = "time: {column: t, unit: s}\nvelocity: {columns: [u, v, w], unit: m/s}\n"
RNG = np.random.default_rng(100_351)


@cache
def mission():
    return draw_one(100_351, seconds=60.0).dive


def dive_of(value, rate_hz=20.0):
    return Dive("d", Path("d.tlog"), "0" * 64, velocity=Signal(np.arange(len(value)) / rate_hz, value))


def measured(count):
    return 0.3 * RNG.standard_normal((count, 3))


@pytest.mark.parametrize("times", [2, 3, 4])
def test_only_the_first_of_velocities_that_come_equally_often_is_kept(times):
    once = measured(100)
    cleaned = without_repeated(dive_of(np.repeat(once, times, axis=0)))
    assert np.array_equal(cleaned.velocity.value, once)
    assert np.array_equal(cleaned.velocity.time_s, np.arange(0, 100 * times, times) / 20.0)
    assert cleaned.notes == (
        f"Each velocity comes {times} times over: they are passed on at 20 Hz and measured at a part of that, so only "
        "the first of each is taken for a reading.",
    )


def test_a_rate_that_does_not_divide_the_other_is_told_too():
    once = measured(100)
    cleaned = without_repeated(dive_of(once[(np.arange(250) * 0.4 + 1e-9).astype(int)]))
    assert np.array_equal(cleaned.velocity.value, once)
    assert cleaned.notes[0].startswith("Each velocity comes 2.5 times over: ")


def test_lost_readings_stay_and_part_no_copies():
    once = measured(100)
    value = np.repeat(once, 2, axis=0)
    value[[7, 50]] = np.nan
    kept = without_repeated(dive_of(value)).velocity.value
    assert np.isnan(kept).all(axis=1).sum() == 2
    assert np.array_equal(kept[np.isfinite(kept).all(axis=1)], once)


def test_a_sensor_without_noise_that_rests_and_goes_stays_as_it_is():
    time_s = np.arange(0.0, 60.0, 0.1)
    surge = np.maximum(np.sin(0.3 * time_s), 0.0)
    dive = dive_of(np.column_stack([surge, 0 * surge, 0 * surge]), 10.0)
    assert without_repeated(dive) is dive
    resting = dive_of(np.zeros((600, 3)))
    assert without_repeated(resting) is resting


def test_an_honest_dive_stays_as_it_is():
    assert without_repeated(mission()) is mission()
    without = replace(mission(), velocity=None)
    assert without_repeated(without) is without


@pytest.mark.parametrize("name", ["open_1", "open_2"])
def test_a_dive_made_elsewhere_stays_as_it_is(name):
    assert not any("times over" in note for note in read_dive(shared("sealed", name, "dive.tlog.gz")).notes)


def test_a_recording_of_a_dvl_that_repeats_is_read_once_each(tmp_path):
    """A table, the shortest way into a dive."""
    rows = [
        "t,u,v,w",
        *(f"{0.1 * i:.1f},{v[0]},{v[1]},{v[2]}" for i, v in enumerate(measured(60).repeat(2, 0))),
    ]
    recorded = of_table(tmp_path, "\n".join(rows), COLUMNS)
    assert len(recorded.velocity) == 60
    assert any("comes 2 times over" in note for note in recorded.notes)


def sent_by(programs, every_s=0.5, count=200, gap_s=0.0007):
    """Depths that `programs` publish, each right behind the other."""
    sent_s = every_s * np.arange(count)
    time_s = (sent_s[:, None] + gap_s * np.arange(programs)).ravel()
    read = np.repeat(np.cumsum(RNG.standard_normal(count)), programs)
    return Dive("d", Path("d.bag"), "0" * 64, depth=Signal(time_s, read[:, None]))


@pytest.mark.parametrize("programs", [2, 3, 5, 9])
def test_only_the_first_of_readings_that_several_programs_publish_is_kept(programs):
    dive = sent_by(programs)
    cleaned = without_copies(dive)
    assert len(cleaned.depth) == 200
    assert cleaned.depth.rate_hz == pytest.approx(2.0)
    assert dive.depth.rate_hz > 1000.0
    (note,) = cleaned.notes
    assert f"one right behind the other (depth {programs} times)" in note


def test_readings_of_a_steady_coarse_or_interrupted_sensor_are_no_copies():
    time_s = np.arange(0.0, 60.0, 0.1)
    slow = np.round(0.02 * time_s, 2)[:, None]
    paused_s = np.where(time_s < 30.0, time_s, time_s + 600.0)
    for depth in (
        Signal(time_s, slow), Signal(time_s, 0 * slow), Signal(paused_s, slow), Signal(time_s[:1], slow[:1]),
        Signal(np.round(time_s + 0.04 * RNG.random(len(time_s)), 3), slow), Signal(time_s[:0], slow[:0]),
    ):  # fmt: skip
        dive = Dive("d", Path("d.bag"), "0" * 64, depth=depth)
        assert without_copies(dive) is dive


def test_readings_that_come_more_than_nine_times_in_all_are_no_copies():
    dive = sent_by(10)
    assert without_copies(dive) is dive


@pytest.mark.parametrize(
    "turn_s", [5.0, 50.0], ids=["fast", "so slowly that most bursts say the same throughout"]
)
def test_distinct_readings_of_a_coarse_sensor_that_are_stamped_in_bursts_stay(turn_s):
    """Depth at 50 Hz to 1 cm, of which a port hands on five at a time."""
    sent_s = 0.02 * np.arange(3000)
    burst_s = 0.1 * (np.arange(3000) // 5) + 0.0005 * (np.arange(3000) % 5)
    depth = np.round(2.0 + np.sin(sent_s / turn_s), 2)[:, None]
    dive = Dive("d", Path("d.bag"), "0" * 64, depth=Signal(burst_s, depth))
    assert without_copies(dive) is dive


def test_a_signal_that_now_and_then_repeats_a_reading_right_behind_it_keeps_both():
    """A tenth of the depths came twice: too few to be several programs' doing."""
    twice = sent_by(2).depth
    kept = np.sort(np.concatenate([np.arange(0, 400, 2), np.arange(1, 400, 20)]))
    dive = Dive("d", Path("d.bag"), "0" * 64, depth=Signal(twice.time_s[kept], twice.value[kept]))
    assert without_copies(dive) is dive


def test_a_table_whose_readings_stand_three_times_over_is_read_once_each_and_shown_at_its_mean_rate(tmp_path):
    depth = sent_by(3).depth
    rows = [f"{t:.6f},{z:.6f}" for t, z in zip(depth.time_s, depth.value[:, 0], strict=True)]
    columns = "time: {column: t, unit: s}\ndepth: {columns: [z], unit: m}\n"
    dive = of_table(tmp_path, "\n".join(["t,z", *rows]), columns)
    assert len(dive.depth) == 200
    _, shown = profiles(read_table(dive.source).streams, column_map(tmp_path / "columns.yaml"))
    assert shown.rate_hz == pytest.approx(6.0, rel=0.02)


def test_commands_that_arrive_five_at_once_are_counted_by_all_and_steady_ones_by_their_usual_step():
    five_at_once = (np.arange(100.0)[:, None] * 0.25 + np.arange(5) * 1e-4).ravel()
    burst = Signal(five_at_once, np.zeros((500, 1)))
    assert (burst.rate_hz, burst.counted_hz) == pytest.approx((1e4, 499 / five_at_once[-1]))
    paused = np.concatenate([np.arange(100.0), 500.0 + np.arange(100.0)]) / 20.0
    assert Signal(paused, np.zeros((200, 1))).counted_hz == pytest.approx(20.0)
    assert Signal(np.zeros(2), np.zeros((2, 1))).counted_hz == 0.0


TWENTY_HZ_S = np.arange(0.0, 60.0, 0.05)
FLIPS = np.where(np.arange(len(TWENTY_HZ_S)) % 2, 40.0, -40.0)
CALM = 20.0 * np.sin(0.5 * TWENTY_HZ_S)


def told_flips(dive):
    return [note for note in missing_signals(dive) if "from each sample to the next" in note]


def asked(*columns):
    """A dive of nothing but thruster commands in N."""
    value = np.column_stack(columns)
    commands = Signal(TWENTY_HZ_S[: len(value)], value)
    return Dive("d", Path("d.csv"), "0" * 64, thrust_cmd=commands)


def test_commands_that_flip_from_sample_to_sample_are_told_with_their_outputs():
    """A sliding mode controller that is logged once a step; the second output follows a pilot."""
    (told,) = told_flips(asked(FLIPS, CALM))
    assert "(output 1)" in told
    assert told_flips(asked(0 * CALM, CALM)) == []


def test_commands_that_dither_by_little_beside_those_of_another_output_are_not_told():
    assert told_flips(asked(FLIPS / 40.0, 10.0 * CALM)) == []
    assert told_flips(asked(FLIPS / 40.0, 0 * CALM))


def test_an_output_that_is_never_known_hides_no_other_that_flips():
    (told,) = told_flips(asked(np.full(len(FLIPS), np.nan), CALM, FLIPS))
    assert "(output 3)" in told


def test_a_wrench_that_flips_is_told_by_its_axes_and_forces_are_held_against_forces():
    wrench = np.column_stack([FLIPS, CALM, 0 * CALM, 0 * CALM, 0 * CALM, FLIPS / 40.0])
    dive = Dive("d", Path("d.csv"), "0" * 64, tau_cmd=Signal(TWENTY_HZ_S, wrench))
    (told,) = told_flips(dive)
    assert told.startswith("Commanded forces flip from each sample to the next (surge and yaw):")
    assert "output" not in told


def test_commands_of_a_loop_that_answers_a_sensors_noise_do_not_flip():
    noise = np.random.default_rng(3).normal(size=len(TWENTY_HZ_S))
    assert told_flips(asked(noise[1:] + 0.4 * noise[:-1])) == []


SHAPE = FILE.vehicle.configurations["only"]


@pytest.fixture(scope="module")
def surge():
    """The fit of surge, where its noise stands in theta, and the standard deviation of the velocity."""
    dive = closed_loop.dive(np.random.default_rng(5), seconds=60.0)
    fit = fit_axes(build_axes(dive, FILE, "only"), SHAPE, lambda *_: None)
    return fit, fit.joint.problems[0].noise_index, float(np.std(dive.velocity.value[:, 0]))


def noisy(surge, noise, pushed=(0,)):
    fit, index, _ = surge
    theta = fit.theta.copy()
    theta[index] = np.log(noise)
    return loud(fit.joint, theta, pushed)


def test_an_honest_dive_is_not_loud(surge):
    fit, *_ = surge
    assert loud(fit.joint, fit.theta, (0,)) == ()


def test_noise_above_a_fifth_of_the_signal_that_the_readings_do_not_show_makes_data_and_model_disagree(surge):
    *_, signal = surge
    assert noisy(surge, 0.198 * signal) == ()
    (axis,) = noisy(surge, 0.202 * signal)
    assert axis.inflated
    assert axis.noise == pytest.approx(202.0 * signal)
    assert axis.signal == pytest.approx(1000 * signal, rel=0.05)
    (doubt,) = loud_doubts([axis])
    assert doubt.about == ("M_u", "D_u")
    assert doubt.outcome is Outcome.DISAGREES
    for part in ("In surge", "the DVL", f"{axis.noise:.3g} mm/s", f"{axis.signal:.3g} mm/s", "check"):
        assert part in doubt.sentence
    assert loud_note([axis]) == ()


def test_noise_and_signal_of_fast_motion_are_written_out():
    fast = Loud(0, "the DVL", 1234.0, 2346.0, "mm/s", inflated=True, pushed=True)
    assert (
        "the fit takes 1230 mm/s of what the DVL reads for noise, of 2350 mm/s in all" in fast.doubt.sentence
    )
    (note,) = loud_note([replace(fast, noise=31.4, signal=123.0, inflated=False)])
    assert "(the DVL, 31 of 120 mm/s)" in note


def test_a_value_by_which_a_missing_force_would_change_another_is_written_out():
    reason = why_not_identifiable("D_v", "sway", 1.0, 1.0, 10820.0, "a drag")
    assert reason == "the model lacks a drag: with that D_v would be 29400"


def test_an_axis_that_hardly_moves_is_told_in_a_note_if_it_was_pushed():
    dive = closed_loop.dive(np.random.default_rng(5), seconds=60.0, noise=0.2)
    fit = fit_axes(build_axes(dive, FILE, "only"), SHAPE, lambda *_: None)
    heard = loud(fit.joint, fit.theta, (0,))
    assert [axis.inflated for axis in heard] == [False]
    assert loud_doubts(heard) == ()
    (note,) = loud_note(heard)
    assert "in surge (the DVL" in note
    assert loud(fit.joint, fit.theta, ()) == ()


def test_a_depth_that_stands_still_while_pressure_sinks_is_left_out_and_one_at_the_surface_is_not():
    time_s = np.arange(0.0, 100.0, 0.1)
    pulses = np.full((len(time_s), 1), 1700.0)
    sinking = 101325.0 + 9789.0 * (1.0 + np.sin(time_s / 10.0))
    still = Signal(time_s, np.zeros((len(time_s), 1)))
    dive = replace(
        closed_loop.dive(np.random.default_rng(1), 100.0),
        pwm=Signal(time_s, pulses),
        depth=still,
        pressure=Signal(time_s, sinking[:, None]),
    )
    kept = without_frozen(dive)
    assert kept.depth is None
    assert "The depth repeats one value" in kept.notes[-1]
    at_surface = replace(dive, pressure=Signal(time_s, np.full((len(time_s), 1), 101325.0)))
    assert without_frozen(at_surface).depth is still
