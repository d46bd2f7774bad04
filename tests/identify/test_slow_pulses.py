"""Pulses between the slow samples of a ground station's log, by the sticks and the attitude that make them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fakes.shared import shared

from bench.field.draw import draw
from bench.field.export import COMPANION, STATION
from bridge.vehicle.coefficients import HEAVE, PITCH, ROLL, YAW
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.thrusters import allocation_matrix, thrust_curve
from identify.diagnose.diagnose import diagnose
from identify.diagnose.filters.nominal import nominal_of
from identify.diagnose.unjudged import lacking
from identify.dive import Dive, Reckoned, Signal
from identify.effects.effect import QUICK_COMMANDS
from identify.ingest.open import read_dive
from identify.ingest.slow_pulses import PULSE, law_of, with_reckoned_pulses
from identify.run.joined_runs import joined
from identify.thrust.wrench import wrench

FILE = load_vehicle("bluerov2")
LONG_S, OFTEN_S, SELDOM_S = 200.0, 0.05, 0.5
LINK_S = 0.1


def recorded(seed=1, law=1.0, armed_from_s=0.0):
    """A dive whose pulses go with sticks that arrive LINK_S early, and with the rates of turn; the true pulses
    at any times come with it."""
    rng = np.random.default_rng(seed)
    often_s, seldom_s = np.arange(0.0, LONG_S, OFTEN_S), np.arange(0.0, LONG_S, SELDOM_S)
    seldom_s = seldom_s + rng.uniform(0.0, OFTEN_S, len(seldom_s))
    sticks = np.repeat(rng.integers(-500, 500, (len(often_s) // 7 + 1, 4)), 7, axis=0)[: len(often_s)]
    gyro = np.cumsum(rng.normal(0, 0.05, (len(often_s), 3)), axis=0)
    by_stick, by_rate = rng.uniform(-0.2, 0.2, (4, 6)), rng.uniform(-20, 20, (3, 6))
    drift = rng.uniform(-50, 50, 6)

    def pulses(at_s):
        held = np.searchsorted(often_s, at_s - LINK_S + 1e-9, side="right") - 1
        rates = np.column_stack([np.interp(at_s, often_s, column) for column in gyro.T])
        asked = sticks[np.maximum(held, 0)] @ by_stick + rates @ by_rate + np.outer(at_s / LONG_S, drift)
        other = rng.uniform(-100, 100, asked.shape)
        return 1500.0 + (at_s >= armed_from_s)[:, None] * (law * asked + (1 - law) * other)

    dive = Dive(
        "d", FILE.path, "0" * 64,
        pwm=Signal(seldom_s, pulses(seldom_s)),
        sticks=Signal(often_s, sticks.astype(np.float64)),
        gyro=Signal(often_s, gyro),
        armed=Signal(often_s, (often_s >= armed_from_s).astype(np.float64)[:, None]),
    )  # fmt: skip
    return dive, pulses


def test_between_the_samples_pulses_follow_the_sticks_and_the_rates():
    dive, pulses = recorded()
    reckoned = with_reckoned_pulses(dive)
    truth = pulses(reckoned.pwm.time_s + 0.5 * np.diff(reckoned.pwm.time_s, append=dive.pwm.time_s[-1]))
    assert np.sqrt(np.mean((reckoned.pwm.value - truth) ** 2)) < 0.02 * truth.std()
    assert reckoned.reckoned.step_s == pytest.approx(SELDOM_S, rel=0.01)
    assert reckoned.reckoned.share < 0.01
    assert "Thruster commands come at 2.0 Hz; between them they are reckoned" in reckoned.notes[-1]
    assert "can't be judged" not in reckoned.notes[-1]


def test_no_pulse_answers_a_stick_before_it_was_sent():
    """Of one clock, all delays within a step of the sticks foretell alike, and a delay came out 14 ms too long."""
    dive, pulses = recorded()
    at_s = np.arange(1.0, LONG_S - 1.0, SELDOM_S) + 1e-3
    sent = Signal(dive.sticks.time_s + LINK_S, dive.sticks.value)
    law = law_of(replace(dive, sticks=sent), Signal(at_s, pulses(at_s)), PULSE)
    assert law.share < 0.01
    assert law.delay_s > -0.005


def test_where_the_mixer_inverts_the_thrusters_curve_it_is_the_thrust_that_follows_the_sticks():
    dive, _ = recorded()
    curve = thrust_curve(FILE.vehicle.thrust_curve, FILE.path.parent)
    newton_per_us = 0.05

    def mixed(pulses):
        return curve.pwm((pulses - curve.neutral_us) * newton_per_us)

    bent = replace(dive, pwm=replace(dive.pwm, value=mixed(dive.pwm.value)))
    assert law_of(bent, bent.pwm, PULSE).share > 0.05
    reckoned = with_reckoned_pulses(bent, FILE)
    assert reckoned.reckoned.share < 0.01
    by_pulses = with_reckoned_pulses(dive)
    low, high = bent.pwm.value.min(axis=0), bent.pwm.value.max(axis=0)
    expected = np.clip(mixed(by_pulses.pwm.value), low, high)
    off = curve.thrust(reckoned.pwm.value) - curve.thrust(expected)
    assert np.sqrt(np.mean(off**2)) < 0.02 * np.std(curve.thrust(expected))


def test_an_attitude_that_is_unknown_once_is_known_again_after_it():
    dive, _ = recorded()
    yaw = np.cumsum(np.random.default_rng(2).normal(0, 0.02, len(dive.gyro)))
    turned = np.column_stack([np.cos(yaw / 2), 0 * yaw, 0 * yaw, np.sin(yaw / 2)])
    by_heading = np.outer(np.interp(dive.pwm.time_s, dive.gyro.time_s, yaw), np.full(6, 200.0))
    held = replace(dive.pwm, value=dive.pwm.value + by_heading)
    gap = turned.copy()
    gap[500] = np.nan
    whole, once = (
        law_of(replace(dive, pwm=held, attitude=Signal(dive.gyro.time_s, known)), held, PULSE).share
        for known in (turned, gap)
    )
    assert once < 1.2 * whole < 0.01


def test_the_pressure_stands_for_the_depth_that_an_autopilot_holds():
    dive, _ = recorded()
    deep = np.cumsum(np.random.default_rng(3).normal(0, 3.0, len(dive.pwm)))
    held = replace(dive.pwm, value=dive.pwm.value + np.outer(deep, np.full(6, 40.0)))
    dive = replace(dive, pwm=held)
    blind = law_of(dive, held, PULSE)
    seen = law_of(
        replace(dive, pressure=Signal(held.time_s, 101_325.0 + 9_800.0 * deep[:, None])), held, PULSE
    )
    assert seen.share < 0.01 < 0.1 * blind.share


@pytest.mark.parametrize(
    "change",
    [{"sticks": None}, {"pwm": Signal(np.arange(0.0, 9.0, 0.1), np.full((90, 6), 1600.0))}],
    ids=["without sticks", "sampled ten times a second"],
)
def test_without_sticks_or_need_the_pulses_stay(change):
    dive = replace(recorded()[0], **change)
    assert with_reckoned_pulses(dive) is dive


def test_pulses_that_do_not_go_with_the_sticks_stay():
    dive, _ = recorded(law=0.0)
    assert with_reckoned_pulses(dive) is dive


def test_before_it_is_armed_the_sticks_move_no_thruster():
    dive, _ = recorded(armed_from_s=60.0)
    reckoned = with_reckoned_pulses(dive).pwm
    np.testing.assert_allclose(reckoned.value[reckoned.time_s < 59.0], 1500.0)
    assert np.ptp(reckoned.value[reckoned.time_s > 61.0]) > 100.0


def each_by_itself(error_us):
    return tuple(map(tuple, (error_us**2 * np.eye(6)).tolist()))


def test_by_what_the_reckoning_misses_the_force_is_unknown_and_no_delay_is_judged():
    dive, _ = recorded()
    (name, shape), *_ = FILE.vehicle.configurations.items()
    by_law = with_reckoned_pulses(dive)
    straight = each_by_itself(30.0)
    known, loose = (
        wrench(
            replace(by_law, reckoned=Reckoned(SELDOM_S, each_by_itself(error_us), straight, share)),
            FILE,
            name,
        )
        for error_us, share in ((0.0, 0.0), (20.0, 0.5))
    )
    np.testing.assert_allclose(known.hidden, 0.0)
    assert (loose.hidden[[0, 1, 5]] > 0.1).all()
    assert (known.sampled_s, loose.sampled_s) == (0.0, 0.5 * SELDOM_S)
    missed = replace(by_law, reckoned=replace(by_law.reckoned, share=0.2))
    assert QUICK_COMMANDS in lacking(missed, None, shape, FILE.vehicle.water)
    assert QUICK_COMMANDS not in lacking(by_law, None, shape, FILE.vehicle.water)
    assert QUICK_COMMANDS not in lacking(replace(by_law, reckoned=None), None, shape, FILE.vehicle.water)


def test_what_thrusters_miss_together_is_a_force_where_they_push_alike_and_no_moment_where_they_do_not():
    """The noise of a depth sensor that moved both upright thrusters counted as a moment in roll, and a stick of yaw
    that was not recorded as a force in surge and in sway."""
    dive, _ = recorded()
    name, shape = next(iter(FILE.vehicle.configurations.items()))
    by_law = with_reckoned_pulses(dive)
    by_law = replace(by_law, pwm=Signal(by_law.pwm.time_s, np.full_like(by_law.pwm.value, 1600.5)))
    for dof in (HEAVE, YAW):
        alike = np.sign(np.round(allocation_matrix(shape)[dof], 6))
        together = tuple(map(tuple, (400.0 * np.outer(alike, alike)).tolist()))
        reckoned = Reckoned(SELDOM_S, together, each_by_itself(30.0), 0.0)
        hidden = wrench(replace(by_law, reckoned=reckoned), FILE, name).hidden
        assert hidden[dof] > 0.1
        np.testing.assert_allclose(np.delete(hidden, dof), 0.0, atol=1e-6)


@pytest.mark.parametrize(("missed_us", "unknown"), [(2.0, False), (10.0, True)])
def test_a_tenth_of_an_autopilots_levelling_that_is_missed_leaves_its_answers_unknown(missed_us, unknown):
    """A righting moment of 0.07 m that is not there was told of an autopilot that levels as hard as the hull does."""
    dive, _ = recorded()
    name = next(iter(FILE.vehicle.configurations))
    reckoned = Reckoned(SELDOM_S, each_by_itself(missed_us), each_by_itself(30.0), 0.0)
    history = wrench(replace(with_reckoned_pulses(dive), reckoned=reckoned), FILE, name)
    assert history.unknown_s[ROLL] == (SELDOM_S if unknown else 0.0)
    assert history.unknown_s[PITCH] == 0.0


def test_thrusters_that_answer_a_noise_hide_no_delay_of_those_that_answer_the_sticks():
    """A depth sensor's noise, read ten times as often as recorded, moved the upright thrusters of many a dive."""
    dive, _ = recorded()
    value = dive.pwm.value.copy()
    value[:, 4:] += np.random.default_rng(5).normal(0.0, 60.0, (len(value), 2))
    value[:, 0] = 1500.0
    noisy = replace(dive, pwm=replace(dive.pwm, value=value))
    assert law_of(noisy, noisy.pwm, PULSE).share > 0.1
    reckoned = with_reckoned_pulses(noisy)
    assert reckoned.reckoned.share < 0.01
    assert "can't be judged" not in reckoned.notes[-1]
    of_servos = Signal(noisy.pwm.time_s, value[:, [4, 5, 0, 1, 2, 3]])
    of_noisy = with_reckoned_pulses(replace(dive, pwm=of_servos), thrusters=3)
    assert of_noisy.reckoned.share > 0.2
    assert "can't be judged" in of_noisy.notes[-1]


def test_a_late_thrust_is_judged_though_the_check_dive_tells_none():
    dive, _ = recorded()
    shape = next(iter(FILE.vehicle.configurations.values()))
    by_law = with_reckoned_pulses(dive)
    missed = replace(by_law, reckoned=replace(by_law.reckoned, share=0.2))
    assert QUICK_COMMANDS not in lacking(by_law, missed, shape, FILE.vehicle.water)
    assert QUICK_COMMANDS in lacking(missed, by_law, shape, FILE.vehicle.water)


def test_a_reckoned_pulse_answers_no_reading_before_its_time():
    """Pulses that knew a reading's noise beforehand made the thrust seem too early by some 15 ms."""
    dive, _ = recorded()
    jump = dive.gyro.value.copy()
    jump[1001:] += 5.0
    jumped, plain = (
        with_reckoned_pulses(replace(dive, gyro=replace(dive.gyro, value=value))).pwm
        for value in (jump, dive.gyro.value)
    )
    at_s = dive.gyro.time_s[1001]
    assert at_s in jumped.time_s
    after = np.flatnonzero(jumped.time_s >= at_s)[0]
    change = np.abs(np.diff(jumped.value, axis=0)).max(axis=1)
    usual = np.abs(np.diff(plain.value, axis=0)).max(axis=1)
    assert change[after - 1] > usual[after - 1] + 1.0
    assert change[after - 4 : after - 1] == pytest.approx(usual[after - 4 : after - 1], abs=1.0)


def test_of_runs_joined_to_one_dive_the_least_known_holds():
    early, late = (with_reckoned_pulses(recorded(seed)[0]) for seed in (1, 2))
    late = replace(late, name="e", sha256="1" * 64, reckoned=replace(late.reckoned, share=0.4))
    assert joined([early, late]).reckoned == joined([late, early]).reckoned == late.reckoned
    as_logged = replace(early, reckoned=None)
    assert joined([as_logged, late]).reckoned == late.reckoned


@pytest.mark.soak
def test_a_firmwares_dive_logged_twice_a_second_tells_the_hulls_drag():
    """The true drag is the simulated firmware's own."""
    file = load_vehicle("ardusub_vectored")
    whole = read_dive(Path(shared("data", "ardusub_sitl", "still.tlog.gz")), None, file)
    seldom = Signal(whole.pwm.time_s[::25], whole.pwm.value[::25])
    dive = with_reckoned_pulses(replace(whole, pwm=seldom))
    diagnosis = diagnose(dive, file, "vectored", progress=lambda *_: None)
    assert (diagnosis.verdict, [cause.name for cause in diagnosis.findings]) == (
        "explained",
        ["quadratic_drag"],
    )
    for name, true in (("X_uu", 48.285), ("Y_vv", 62.08)):
        assert diagnosis.findings[0].parameters[name].value == pytest.approx(true, rel=0.05)


@pytest.mark.parametrize(("number", "levelled"), [(5, {PITCH}), (7, set())])
def test_roll_and_pitch_are_judged_by_pulses_of_twice_a_second_unless_an_autopilot_levels_them_in_between(
    tmp_path, number, levelled
):
    """The thrust that levels looks like a righting moment: 0.3 m of one was told of a hull of 0.08 m."""
    case = draw(100_002, number, "none", seconds=100.0)
    assert case.autopilot.level.any() == bool(levelled)
    (tmp_path / "rov.yaml").write_text(case.vehicle.text)
    file = load_vehicle(str(tmp_path / "rov.yaml"))
    (name,) = file.vehicle.configurations
    for rates, left in ((COMPANION, set()), (STATION, levelled)):
        log = tmp_path / "dive.tlog"
        log.write_bytes(replace(case, rates=rates).recording(0))
        built = nominal_of(read_dive(log, None, file), file, name).built
        assert {dof for dof, why in built.missing.items() if "may level it" in why} == left
        assert {ROLL, PITCH} & {axis.dof for axis in built.axes} == {ROLL, PITCH} - {*built.missing}
