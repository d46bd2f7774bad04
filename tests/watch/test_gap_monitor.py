"""The live gap: the drift of a model driven by recorded pulses, its floor, the alarm, and what is named for it."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from soak import rest_in_soak, rows_rest_in_soak

from bridge.simulator.direct import simulate_truth
from bridge.simulator.truth import load_truth
from bridge.vehicle.coefficients import BY_NAME
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.legs import Leg, Mission
from bridge.vehicle.parameters import set_crc
from bridge.wire.readings import Reading
from gcs_plugin.monitor.causes import likeliest
from gcs_plugin.monitor.gap import LEARNING_S, GapMonitor, gap_line, worst
from gcs_plugin.monitor.live import LiveGap
from gcs_plugin.monitor.model import model_of
from gcs_plugin.monitor.predictor import SECOND, STEP_S, Drift, Predictor, Quick, Second, names_of, sums_of

RUVIFIST = load_vehicle("ruvifist:survey")
TRUTH = load_truth(RUVIFIST, "survey")
MODEL = model_of(TRUTH.model, RUVIFIST, "survey")
LEVEL = (1.0, 0.0, 0.0, 0.0)
STILL_US = (1500.0,) * 8
WITHOUT_LEVEL = {
    name: value for name, value in TRUTH.model.items() if name not in ("I_p", "I_q", "D_p", "D_q")
}
"""As identified: no dive tells what turns it in roll and pitch."""


def coasting(start_s, force_n=0.0):
    """A second of a hull without thrust that moves ahead at 0.4 m/s, but for what a force has made of it since."""
    mass, damping = MODEL.mass[0], MODEL.damping[0]
    time_s = start_s + STEP_S * np.arange(SECOND + 1)
    left = np.exp(-damping / mass * time_s)
    nu = np.zeros((SECOND + 1, 6))
    nu[:, 0] = 0.4 * left + force_n / damping * (1.0 - left)
    return Second(nu, np.tile(LEVEL, (SECOND + 1, 1)), np.tile(STILL_US, (SECOND, 1)))


def test_a_vehicle_that_obeys_its_model_does_not_drift_from_it():
    predictor = Predictor(replace(MODEL, configuration=replace(MODEL.configuration, net_buoyancy_n=0.0)))
    drifts = [predictor.step(coasting(float(k))) for k in range(8)]
    assert drifts[:5] == [None] * 5
    assert np.abs(drifts[-1].drift).max() < 1e-5


def test_the_drift_is_what_a_missing_force_makes_in_five_seconds():
    predictor = Predictor(MODEL)
    drifts = [predictor.step(coasting(float(k), force_n=2.0)) for k in range(8)]
    mass, damping = MODEL.mass[0], MODEL.damping[0]
    exact = 2.0 / damping * (1.0 - math.exp(-5.0 * damping / mass))
    assert drifts[-1].drift[0] == pytest.approx(exact, rel=1e-3)
    assert drifts[-1].drift[0] == pytest.approx(
        2.0 * drifts[-1].causes[names_of(MODEL).index("pull north")][0], rel=1e-3
    )


def test_axes_without_mass_and_damping_are_not_judged():
    model = model_of({"M_u": 96.0, "D_u": 42.0, "M_v": 138.0}, RUVIFIST, "survey")
    assert model.dofs == (0,)
    predictor = Predictor(model)
    drift = [predictor.step(coasting(float(k))) for k in range(6)][-1].drift
    assert np.isfinite(drift[0])
    assert np.isnan(drift[1:]).all()
    assert model_of({}, RUVIFIST, "survey") is None


NO_CAUSE = np.zeros((len(names_of(MODEL)), 6))
UNMOVED = Quick(np.zeros(2), np.zeros((8, 2)), np.zeros((8, 2)))


def drifts_of(rng, seconds, size=1.0):
    """Drift of a model without a gap, correlated as in five-second windows, with a floor of 5 mm/s; `size` times it."""
    white = rng.standard_normal((seconds + 4, 6))
    mean = np.stack([white[k : k + seconds] for k in range(5)]).sum(axis=0) / math.sqrt(5.0)
    return [Drift(5e-3 * size * row, np.zeros(6), NO_CAUSE, np.zeros(2), UNMOVED) for row in mean]


def monitor_after(drifts):
    monitor = GapMonitor(MODEL)
    for drift in drifts:
        monitor.add(drift)
    return monitor


def test_the_floor_is_learnt_in_the_first_minute():
    rng = np.random.default_rng(1)
    monitor = monitor_after(drifts_of(rng, LEARNING_S - 10))
    assert monitor.gap.axes == ()
    assert monitor.gap.learns_s == 10
    assert gap_line(monitor.gap) == "its noise floor is learnt, 10 s more"
    for drift in drifts_of(rng, 300):
        monitor.add(drift)
    assert [axis.floor for axis in monitor.gap.axes] == pytest.approx([5.6e-3] * 6, rel=0.3)
    assert monitor.gap.since_s is None


def steady(off, seconds):
    drift = Drift(np.array([off, 0, 0, 0, 0, 0.0]), np.zeros(6), NO_CAUSE, np.zeros(2), UNMOVED)
    return [drift] * seconds


def first_alarm(monitor, drifts):
    for second, drift in enumerate(drifts, start=1):
        monitor.add(drift)
        if monitor.gap.since_s is not None:
            return second
    return None


def test_a_departure_that_stays_is_an_alarm_after_half_a_minute_and_ends_a_minute_after_it():
    monitor = monitor_after(drifts_of(np.random.default_rng(2), 120))
    assert 25 <= first_alarm(monitor, steady(0.03, 60)) <= 35
    assert [axis.dof for axis in monitor.gap.axes if axis.high] == [0]
    assert worst(monitor.gap).dof == 0
    assert monitor.gap.causes == ()  # nothing that is tried makes such a drift
    quiet = drifts_of(np.random.default_rng(3), 200)
    ends = next(k for k, drift in enumerate(quiet) if monitor.add(drift) or monitor.gap.since_s is None)
    assert 60 < ends < 100


def test_a_current_just_west_of_north_goes_towards_000_and_not_360():
    causes = np.zeros((len(names_of(MODEL)), 6))
    causes[names_of(MODEL).index("water north"), 0] = causes[names_of(MODEL).index("water east"), 1] = 1.0
    drift = Drift(np.array([0.1, -0.0002, 0.0, 0.0, 0.0, 0.0]), np.zeros(6), causes, np.zeros(2), UNMOVED)
    (cause,) = likeliest(MODEL, [drift] * 30, np.ones((30, 6)), 0.5)
    assert cause.words == "a current of 0.10 m/s towards 000"


def test_a_kick_however_hard_is_no_alarm():
    rng = np.random.default_rng(4)
    monitor = monitor_after(drifts_of(rng, 120))
    assert first_alarm(monitor, [*steady(1.0, 10), *drifts_of(rng, 60)]) is None


@pytest.mark.parametrize("off", [0.2, 2.0])
def test_a_wrong_reading_of_the_dvl_hides_no_departure_after_it(off):
    """It shows in the drift of its own second, and again, turned round, five seconds later."""
    rng = np.random.default_rng(2)
    monitor = monitor_after(drifts_of(rng, 300))
    wrong = [*steady(off, 1), *drifts_of(rng, 4), *steady(-off, 1)]
    assert first_alarm(monitor, [*wrong, *drifts_of(rng, 90)]) is None
    assert 20 <= first_alarm(monitor, steady(0.03, 60)) <= 35


@pytest.mark.parametrize("seconds", rest_in_soak([900, 3600]))
def test_sea_and_noise_are_no_alarm_for_as_long_as_it_runs(seconds):
    monitor = GapMonitor(MODEL)
    assert first_alarm(monitor, held_drifts(np.random.default_rng(5), seconds)) is None


HELD_N = 0.4
"""With which each vertical thruster holds its vehicle."""


def held_drifts(rng, seconds, share=0.0, number=6):
    """Drift of a vehicle that vertical thrusters hold down; one of them lacks a share of its thrust."""
    causes = NO_CAUSE.copy()
    for thruster in range(4, 8):
        causes[thruster] = -8e-3 * HELD_N * MODEL.matrix[:, thruster] * [1, 1, 1, 7, 3, 1]
    return [
        replace(drift, drift=drift.drift + share * causes[number - 1], causes=causes)
        for drift in drifts_of(rng, seconds)
    ]


def test_a_loss_below_the_floor_is_an_alarm_within_two_minutes_and_is_named():
    rng = np.random.default_rng(10)
    monitor = monitor_after(held_drifts(rng, 200))
    weak = held_drifts(rng, 240, share=0.8)
    assert 30 < first_alarm(monitor, weak[:120]) < 110
    assert max(axis.drift / axis.floor for axis in monitor.gap.axes) < 1.6
    assert monitor.gap.causes[0].label == "weak_thruster of thruster 6"
    assert [axis.dof for axis in monitor.gap.axes if axis.high] == [2, 3]  # what a vertical thruster moves
    for drift in weak[120:]:
        monitor.add(drift)
    assert monitor.gap.since_s > 100  # it lasts as long as the loss
    mended = held_drifts(rng, 300)
    ends = next(k for k, drift in enumerate(mended) if monitor.add(drift) or monitor.gap.since_s is None)
    assert 60 < ends < 180


def test_a_kick_as_of_a_loss_is_no_alarm():
    rng = np.random.default_rng(12)
    monitor = monitor_after(held_drifts(rng, 200))
    kick = held_drifts(rng, 5, share=20.0)
    assert first_alarm(monitor, [*kick, *held_drifts(rng, 120)]) is None


def test_a_loss_that_was_there_from_the_first_minute_on_is_no_alarm():
    monitor = GapMonitor(MODEL)
    assert first_alarm(monitor, held_drifts(np.random.default_rng(11), 900, share=0.8)) is None


def answering(rng, seconds, share=0.0, number=6):
    """Seconds of a vehicle whose four vertical thrusters dither alike; one of them lacks a share of its thrust."""
    out = []
    arms = np.zeros((8, 2))
    arms[4:] = [[-2.0, 0.6], [2.0, 0.6], [-2.0, -0.6], [2.0, -0.6]]
    for drift in drifts_of(rng, seconds):
        lost = rng.standard_normal((SECOND, 1, 1)) * 2e-4 * arms
        rates = 1e-3 * rng.standard_normal((SECOND, 2)) + share * lost[:, number - 1]
        score = (lost * rates[:, None]).sum(axis=0)
        out.append(replace(drift, quick=Quick((rates**2).sum(axis=0), (lost**2).sum(axis=0), score)))
    return out


def test_a_loss_that_shows_only_in_how_rates_answer_dither_is_found_within_a_minute_and_named():
    rng = np.random.default_rng(13)
    monitor = monitor_after(answering(rng, 200))
    assert 10 < first_alarm(monitor, answering(rng, 60, share=0.7)) < 60
    assert max(axis.drift / axis.floor for axis in monitor.gap.axes) < 1.6
    assert monitor.gap.causes[0].label == "weak_thruster of thruster 6"
    assert monitor.gap.causes[0].probability > 0.5
    assert re.fullmatch(r"thruster 6 gives \d\d % less", monitor.gap.causes[0].words)


def test_a_model_that_has_not_roll_and_pitch_names_the_weak_thruster_and_not_how_much_it_lacks():
    rng = np.random.default_rng(13)
    monitor = GapMonitor(model_of(WITHOUT_LEVEL, RUVIFIST, "survey"))
    assert first_alarm(monitor, answering(rng, 200)) is None
    assert 10 < first_alarm(monitor, answering(rng, 60, share=0.7)) < 60
    assert "thruster 6 gives less thrust" in [cause.words for cause in monitor.gap.causes]


def test_what_goes_with_the_moment_about_the_same_axis_tells_of_no_loss():
    rng = np.random.default_rng(16)
    lost = rng.standard_normal((SECOND, 8, 2))
    level = lost - lost.mean(axis=1, keepdims=True)
    moment = lost.sum(axis=1)
    assert sums_of(-0.3 * moment, lost).score == pytest.approx(np.zeros((8, 2)), abs=1e-9)
    assert sums_of(level[:, 5], level).score == pytest.approx((level[:, 5, None] * level).sum(axis=0))


def test_dither_of_sound_thrusters_and_a_loss_from_the_first_minute_on_are_no_alarm():
    assert first_alarm(GapMonitor(MODEL), answering(np.random.default_rng(14), 900)) is None
    assert first_alarm(GapMonitor(MODEL), answering(np.random.default_rng(15), 600, share=0.7)) is None


def said(run):
    """What the bridge would send of a dive, with the noise of its sensors."""
    rng = np.random.default_rng(6)
    yield Reading("alive", math.nan, (1.0, 12.0, 0.0))
    rates = run.nu[:, 3:] + 7e-4 * rng.standard_normal((len(run.time_s), 3))
    velocity = run.nu[:, :3] + 4e-3 * rng.standard_normal((len(run.time_s), 3))
    for k, time_s in enumerate(run.time_s.tolist()):
        yield Reading("pwm", time_s, tuple(run.actuations[k].pwm_us))
        yield Reading("imu", time_s, (0.0, 0.0, -9.8, *rates[k].tolist(), math.nan))
        yield Reading("attitude", time_s, (*run.state[k, 3:7].tolist(), *rates[k].tolist()))
        if k % 2 == 0:
            yield Reading("dvl", time_s, (*velocity[k].tolist(), 0.004))


def live_with(coefficients):
    return LiveGap(RUVIFIST, {BY_NAME[name].parameter_id(0): value for name, value in coefficients.items()})


THERE_AND_BACK = Mission(
    "there and back",
    tuple(
        Leg(12.0, surge_m_s=u, yaw_rad_s=r, transient_s=5.0)
        for u, r in ((0.4, 0.0), (0.0, 0.1), (0.4, 0.0), (0.2, 0.1)) * 3
    ),
)


def until_alarm(live, run):
    """Feed a dive until the alarm: the times and gaps before it."""
    before = []
    for reading in said(run):
        live.take(reading)
        if live.gap is not None and live.gap.since_s is not None:
            return before
        before.append((reading.time_s, live.gap))
    return before


def test_a_vertical_thruster_that_weakens_is_found_within_a_minute_by_a_model_without_roll_and_pitch():
    run = simulate_truth(
        RUVIFIST, "survey", THERE_AND_BACK, seed=7, truth=replace(TRUTH, onset={"T6_gain": 0.4}, onset_s=90.0)
    )
    live = live_with(WITHOUT_LEVEL)
    assert 98.0 < until_alarm(live, run)[-1][0] < 150.0
    assert "thruster 6 gives less thrust" in [cause.words for cause in live.gap.causes]
    assert [axis.dof for axis in live.gap.axes if axis.high] == [2]


@pytest.mark.parametrize(
    ("onset", "label", "words"),
    rows_rest_in_soak(
        [
            ({"current_n": 0.15}, "steady_current", "a current of 0.1"),
            # Vertical, while the depth is held.
            ({"T6_gain": 0.4}, "weak_thruster of thruster 6", "thruster 6 gives "),
            ({"T2_gain": 0.5}, "weak_thruster of thruster 2", "thruster 2 gives 49 % less"),
            ({"tether": 3.0}, "tether", "a pull of "),
        ],
        keep=2,
    ),
)
def test_what_sets_in_during_a_dive_is_found_and_named(onset, label, words):
    truth = replace(TRUTH, onset=onset, onset_s=90.0)
    run = simulate_truth(RUVIFIST, "survey", THERE_AND_BACK, seed=7, truth=truth)
    live = live_with(TRUTH.model)
    before = until_alarm(live, run)
    assert 98.0 < before[-1][0] < 143.0
    assert live.gap.causes[0].label == label
    assert live.gap.causes[0].words.startswith(words)
    assert before[-1][1].axes
    # A vertical thruster moves neither surge nor sway nor yaw.
    assert {axis.dof for axis in live.gap.axes if axis.high}.isdisjoint({0, 1, 5}) is ("T6_gain" in onset)


def test_nothing_is_compared_without_a_model_a_file_or_while_disarmed():
    readings = list(said(simulate_truth(RUVIFIST, "survey", THERE_AND_BACK, seed=8)))[:6000]
    for live, taken in (
        (LiveGap(RUVIFIST, {}), readings),
        (LiveGap(None, {}), readings),
        (live_with(TRUTH.model), readings[1:]),
    ):
        for reading in taken:
            live.take(reading)
        assert live.gap is None
    live = live_with(TRUTH.model)
    for reading in readings:
        live.take(reading)
    assert live.gap.axes
    live.parameter("FF0_D_U", 50.0)
    for reading in said_later(readings, 200.0):
        live.take(reading)
        if live.gap is not None and live.gap.learns_s:
            break
    assert live.gap.learns_s > 0  # the floor of another model is another one
    live.take(Reading("alive", math.nan, (0.0, 12.0, 0.0)))
    assert live.gap is None


def test_a_set_that_is_only_written_changes_no_model_until_it_is_in_force():
    readings = list(said(simulate_truth(RUVIFIST, "survey", THERE_AND_BACK, seed=8)))[:6000]
    live = live_with(TRUTH.model)
    for reading in readings:
        live.take(reading)
    live.parameter("FF_ACTIVE", 4711.0)
    live.parameter("FF0_D_U", 50.0)
    assert is_kept(live, said_later(readings, 200.0))
    live.parameter("FF_ACTIVE", 4711.0)
    assert is_kept(live, said_later(readings, 400.0))
    live.parameter("FF_ACTIVE", 4712.0)
    assert not is_kept(live, said_later(readings, 600.0))


def test_values_that_make_up_the_set_in_force_are_taken_over_though_that_was_in_force_before():
    readings = list(said(simulate_truth(RUVIFIST, "survey", THERE_AND_BACK, seed=8)))[:6000]
    live = live_with(TRUTH.model)
    for reading in readings:
        live.take(reading)
    live.parameter("FF_ACTIVE", float(set_crc({"FF0_D_U": 50.0})))
    live.parameter("FF0_D_U", 50.0)
    assert not is_kept(live, said_later(readings, 200.0))


def is_kept(live, readings):
    """Whether the floor that was learnt holds on while these are heard; another model has another floor."""
    for reading in readings:
        live.take(reading)
        if live.gap is not None and live.gap.learns_s:
            return False
    return True


@pytest.mark.parametrize(
    ("coefficients", "silent"), [({}, ()), (TRUTH.model, ("dvl",)), (TRUTH.model, ("pwm",))]
)
def test_a_vehicle_that_can_not_be_compared_fills_no_memory_however_long(coefficients, silent):
    live = live_with(coefficients)
    live.take(Reading("alive", math.nan, (1.0, 12.0, 0.0)))
    for step in range(150 * 20):
        for signal in {"imu", "fog", "attitude", "pwm", "dvl", "battery"} - {*silent}:
            live.take(Reading(signal, 0.05 * step, (1.0,) * 8))
    assert sum(len(samples.time_s) for samples in live._signals.values()) < 6 * 20 * 20


def test_what_a_vehicle_lacks_to_be_compared_is_said():
    def after(live, beats, *signals):
        for _ in range(beats):
            live.take(Reading("alive", math.nan, (1.0, 12.0, 0.0)))
        for second, signal in enumerate(signals):
            live.take(Reading(signal, float(second), (0.0,) * 8))
        return live.lacks

    everything = ("imu", "attitude", "pwm", "dvl")
    assert after(LiveGap(None, {}), 4) == ""
    assert after(LiveGap(None, {}), 5) == "needs a vehicle file"
    assert after(LiveGap(RUVIFIST, {}), 5, "imu", "attitude") == "no DVL velocity, pulses from our bridge"
    assert after(LiveGap(RUVIFIST, {}), 5, *everything) == "no identified model is known here"
    flies = LiveGap(RUVIFIST, {})
    flies.take(Reading("ff_mode", math.nan, (3.0,)))
    assert after(flies, 5, *everything) == "the model that it flies with is not known here"
    assert after(live_with(TRUTH.model), 5, *everything) == ""


def said_later(readings, by_s):
    return [replace(reading, time_s=reading.time_s + by_s) for reading in readings[1:]]


def test_a_hole_in_the_readings_takes_nothing_back_and_one_that_lasts_leaves_the_gap_unknown():
    readings = list(said(simulate_truth(RUVIFIST, "survey", THERE_AND_BACK, seed=9)))
    live, learnt = live_with(TRUTH.model), None
    for reading in readings:
        hole = reading.signal == "dvl" and 80.0 < reading.time_s < 84.0
        if hole or (reading.signal == "dvl" and reading.time_s > 110.0):
            continue
        live.take(reading)
        if reading.time_s < 80.0:
            learnt = live.gap
        elif 95.0 < reading.time_s < 110.0:
            assert live.gap.axes
            assert live.gap.axes[3].floor == pytest.approx(learnt.axes[3].floor, rel=0.3)
    assert live.gap is None


def at_rest(seconds, dvl_hz, silent=lambda *_: False):
    """What a vehicle at rest says, all at 20 Hz but its DVL."""
    said = [
        (time_s, signal, values)
        for signal, hz, values in (
            ("pwm", 20.0, STILL_US),
            ("imu", 20.0, (0.0, 0.0, -9.8, 0.0, 0.0, 0.0, math.nan)),
            ("attitude", 20.0, (*LEVEL, 0.0, 0.0, 0.0)),
            ("dvl", dvl_hz, (0.0, 0.0, 0.0, 0.004)),
        )
        for time_s in (np.arange(seconds * hz) / hz).tolist()
        if not silent(signal, time_s)
    ]
    yield Reading("alive", math.nan, (1.0, 12.0, 0.0))
    yield from (Reading(signal, time_s, values) for time_s, signal, values in sorted(said))


def judged_s(readings):
    """How many seconds of less than a minute are judged; the first five after a hole can't be."""
    live = live_with(TRUTH.model)
    for reading in readings:
        live.take(reading)
    return LEARNING_S - live.gap.learns_s


@pytest.mark.parametrize("dvl_hz", [5.0, 7.3, 7.5, 10.0, 12.1])
def test_every_second_is_judged_at_whatever_rate_the_dvl_pings(dvl_hz):
    assert judged_s(at_rest(40, dvl_hz)) == pytest.approx(40 - 5, abs=2)


def test_every_second_is_judged_also_where_the_attitudes_boot_time_goes_round_after_seven_weeks():
    round_s = 2**32 / 1e3
    aged = [replace(reading, time_s=reading.time_s + round_s - 20.0) for reading in at_rest(40, 10.0)]
    readings = [
        replace(reading, time_s=reading.time_s % round_s) if reading.signal == "attitude" else reading
        for reading in aged
    ]
    assert judged_s(readings) == pytest.approx(40 - 5, abs=2)


@pytest.mark.parametrize("lost", [("dvl",), ("pwm", "imu", "attitude", "dvl")])
def test_a_second_within_a_hole_of_the_readings_is_not_made_up_from_those_around_it(lost):
    hole = at_rest(40, 10.0, silent=lambda signal, time_s: signal in lost and 20.0 < time_s < 24.0)
    assert judged_s(hole) == pytest.approx(20 - 5 + 16 - 5, abs=2)


@pytest.mark.parametrize("other", [(0.0, 30.0, 8.0), (0.0, 26.0, 8.0), (0.0, 18.0, 8.0)])
def test_the_heartbeats_of_a_camera_a_gimbal_or_a_computer_aboard_disarm_no_vehicle(other):
    def with_beats():
        for number, reading in enumerate(at_rest(40, 10.0)):
            yield reading
            if number % 70 == 0:
                yield Reading("alive", math.nan, other)
                yield Reading("alive", math.nan, (1.0, 12.0, 3.0))

    assert judged_s(with_beats()) == pytest.approx(40 - 5, abs=2)


def test_without_an_autopilot_the_vehicle_is_armed_as_its_companion_says():
    later = [*at_rest(40, 10.0)][1:]
    assert judged_s([Reading("alive", math.nan, (1.0, 18.0, 8.0)), *later]) == pytest.approx(40 - 5, abs=2)
