import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from bridge.errors import ConfigError
from bridge.vehicle.autopilot import Actuation, Autopilot
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.in_force import ModelInForce
from bridge.vehicle.mode import Mode
from bridge.vehicle.navigation import Navigation
from bridge.vehicle.references import Reference
from bridge.vehicle.thrusters import allocation_matrix, thrust_curve
from bridge.wire.status_codes import CrewText, Topic, decoded

FILE = load_vehicle("ruvifist")
MODEL = {"M_u": 111.6, "D_u": 56.24, "M_v": 112.41, "D_v": 53.05, "I_r": 16.0, "D_r": 26.07}
HERE = Navigation((0.3, 0.1, 0.01), 0, (0.001, 0.002, 0.05), 0, (1.0, 0.0, 0.0, 0.0), 0.1, 0, 0.62, 0)
ASK = Reference((0.4, 0.2, 0, 0, 0, 0.1), (0.05, 0.02, 0, 0, 0, 0.01), 0.2, 0.6)


def autopilot(
    mode: Mode, model: dict[str, float] | None = None, configuration: str = "hovering"
) -> Autopilot:
    return Autopilot(
        FILE.vehicle, configuration, lambda _: MODEL if model is None else model, FILE.path.parent, mode
    )


def heard(time_s: float, **silent_since_s: float) -> Navigation:
    """The same readings, all of them of `time_s` but for those that are older."""
    times = dict.fromkeys(("velocity_time_s", "rate_time_s", "attitude_time_s", "depth_time_s"), time_s)
    return replace(HERE, **(times | silent_since_s))


def tick(mode: Mode, model: dict[str, float] | None = None) -> Actuation:
    """The eighth: the feed-forward is there by then."""
    pilot = autopilot(mode, model)
    return [pilot.step(0.05 * step, heard(0.05 * step), ASK) for step in range(8)][-1]


def test_the_feedforward_is_computed_in_every_mode_and_applied_in_two():
    off, shadow, alone, both = (tick(mode) for mode in Mode)
    wanted = (111.6 * 0.05 + 56.24 * 0.4, 112.41 * 0.02 + 53.05 * 0.2, 0, 0, 0, 16 * 0.01 + 26.07 * 0.1)
    for actuation in (off, shadow, alone, both):
        assert actuation.tau_ff == pytest.approx(wanted)
    assert off.tau_cmd == shadow.tau_cmd == pytest.approx(off.tau_pid)
    assert both.tau_cmd == pytest.approx(np.add(both.tau_pid, wanted))
    assert [a.mode for a in (off, shadow, alone, both)] == [0, 1, 2, 3]


def test_feedforward_alone_silences_the_pid_of_its_axes_and_leaves_that_of_heave():
    alone, off = tick(Mode.ALONE), tick(Mode.OFF)
    assert [alone.tau_pid[dof] for dof in (0, 1, 5)] == [0.0, 0.0, 0.0]
    assert alone.tau_pid[2] == off.tau_pid[2] != 0.0
    assert alone.tau_cmd == pytest.approx(np.add(alone.tau_pid, alone.tau_ff))


def test_the_pulse_widths_make_the_commanded_wrench_where_no_thrust_is_small():
    actuation = autopilot(Mode.ALONE).step(
        0.0, HERE, Reference((0.5, 0, 0, 0, 0, 0), (0.1, 0, 0, 0, 0, 0), 0.1, 1.0)
    )
    curve = thrust_curve(FILE.vehicle.thrust_curve, FILE.path.parent)
    thrust = curve.thrust(actuation.pwm_us)
    assert np.abs(thrust).min() > 3.0
    matrix = allocation_matrix(FILE.vehicle.configurations["hovering"])
    np.testing.assert_allclose(matrix @ thrust, actuation.tau_cmd, atol=1e-9)


def test_small_thrusts_are_lost_in_the_dead_zone_that_the_pulse_widths_do_not_jump():
    level = Navigation((0.0, 0, 0), 0, (0.0, 0, 0), 0, (1.0, 0, 0, 0), 0.0, 0, 0.6, 0)
    crawl = Reference((0.03, 0, 0, 0, 0, 0), (0.0,) * 6, 0.0, 0.6)
    whisper = autopilot(Mode.OFF).step(0.0, level, crawl)
    assert whisper.tau_cmd[0] == pytest.approx(whisper.tau_pid[0])
    assert whisper.tau_pid[0] > 1.0
    assert all(1472 <= pwm <= 1528 for pwm in whisper.pwm_us)
    assert whisper.pwm_us[0] > 1505


def test_a_parameter_that_is_not_a_number_gives_zero_and_one_text_until_it_changes():
    model = dict(MODEL, M_u=math.nan)
    pilot = autopilot(Mode.BOTH, model)
    for step in range(3):
        assert pilot.step(0.05 * step, HERE, ASK).tau_ff[0] == 0.0
    texts = pilot.take_texts()
    assert len(texts) == 1
    assert "M_u is nan" in texts[0]
    assert pilot.take_texts() == []
    model["M_u"] = 111.6
    assert pilot.step(0.15, HERE, ASK).tau_ff[0] > 0
    model["M_u"] = math.inf
    pilot.step(0.2, HERE, ASK)
    assert len(pilot.take_texts()) == 1


def test_what_another_set_lacks_as_well_is_told_again_and_what_no_set_can_mend_is_not():
    model = dict(MODEL, M_u=math.nan, D_v=math.nan)
    pilot = autopilot(Mode.BOTH, model)
    blind = replace(HERE, depth_m=math.nan)
    pilot.step(0.0, blind, ASK)
    first = {decoded(text).words for text in pilot.take_texts()}
    assert {"FF surge off: M_u is nan", "FF sway off: D_v is nan"} < first
    model["M_u"] = 111.6
    pilot.step(0.05, blind, ASK)
    assert [decoded(text) for text in pilot.take_texts()] == [
        CrewText("FF sway off: D_v is nan", Topic.SET_FAULT)
    ]


def test_an_impossible_demand_stays_within_the_thrusters_and_is_told_as_it_was_limited():
    actuation = autopilot(Mode.BOTH).step(
        0.0, HERE, Reference((9, 9, 0, 0, 0, 9), (9, 9, 0, 0, 0, 9), 3.0, 50.0)
    )
    thrust = thrust_curve(FILE.vehicle.thrust_curve, FILE.path.parent).thrust(actuation.pwm_us)
    assert thrust.max() <= 40.0 + 1e-9
    assert thrust.min() >= -39.908 - 1e-9
    assert abs(actuation.tau_cmd[0]) < 140


@pytest.mark.parametrize("effects", [{}, {"T1_gain": 0.9}])
def test_while_all_thrusters_are_scaled_down_no_integral_grows_with_accepted_effects_as_without_any(effects):
    pilot = autopilot(Mode.BOTH, MODEL | effects)
    hard, times_s = replace(ASK, nu_dot=(9.0, 9.0, 0.0, 0.0, 0.0, 0.0)), [0.05 * step for step in range(60)]
    surge = [pilot.step(at_s, heard(at_s), replace(hard, time_s=at_s)).tau_pid[0] for at_s in times_s]
    assert surge[-1] == pytest.approx(surge[20])


def test_the_configuration_chooses_the_parameters():
    asked = []
    pilot = Autopilot(FILE.vehicle, "hovering", lambda i: asked.append(i) or MODEL, FILE.path.parent)
    assert pilot.step(0.0, HERE, ASK).veh_cfg == 1
    assert asked == [1]


def test_coming_back_from_feedforward_alone_the_pid_starts_without_an_old_integral():
    pilot, fresh = autopilot(Mode.OFF), autopilot(Mode.OFF)
    for step in range(100):
        pilot.step(0.05 * step, heard(0.05 * step), ASK)
    pilot.mode = Mode.ALONE
    pilot.step(5.0, heard(5.0), ASK)
    pilot.mode = Mode.OFF
    again, first = pilot.step(5.05, heard(5.05), ASK), fresh.step(5.05, heard(5.05), ASK)
    assert [again.tau_pid[dof] for dof in (0, 1, 5)] == pytest.approx(
        [first.tau_pid[dof] for dof in (0, 1, 5)]
    )


@pytest.mark.parametrize("mode", Mode)
def test_after_minutes_in_which_it_was_not_stepped_it_begins_as_a_fresh_one(mode):
    """As between two flights: the pause is not integrated, and nothing of the flight before acts."""
    pilot, fresh = autopilot(mode), autopilot(mode)
    for step in range(100):
        pilot.step(0.05 * step, heard(0.05 * step), ASK)
    for time_s in (125.0, 125.05):
        again, first = pilot.step(time_s, heard(time_s), ASK), fresh.step(time_s, heard(time_s), ASK)
        assert again.tau_pid == pytest.approx(first.tau_pid)
        assert again.pwm_us == pytest.approx(first.pwm_us)


def test_the_minute_in_shadow_begins_anew_after_minutes_in_which_it_was_not_stepped():
    """As of a program that steps it only while it is armed: nobody knows what was done to the vehicle meanwhile."""
    pilot = autopilot(Mode.SHADOW)
    steady = Reference((0.3, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0,) * 6, 0.1, 0.62)
    for step in range(1300):
        pilot.step(0.05 * step, replace(heard(0.05 * step), velocity=(0.25, 0.0, 0.0)), steady)
    assert "explained" in pilot.unproven()
    pilot.step(700.0, heard(700.0), steady)
    assert pilot.unproven() == "shadow: 0 of 60 s flown since a pause"


def test_what_the_vehicle_does_while_the_feed_forward_is_raised_is_no_part_of_a_minute_in_shadow():
    """It turned round meanwhile, and so it had begun two seconds astern that it ended ahead."""
    model = ModelInForce(lambda _: MODEL, 1, FILE.vehicle.configurations["hovering"], (100.0,) * 6)
    model.renew()
    for ticks, mode, u in ((20, Mode.SHADOW, -0.9), (100, Mode.BOTH, 0.3), (1201, Mode.SHADOW, 0.3)):
        force = (56.24 * u, 0.0, 0.0, 0.0, 0.0, 0.0)
        for _ in range(ticks):
            model.judge(mode, "", 0.05, force, force, replace(HERE, velocity=(u, 0.0, 0.0), rate=(0.0,) * 3))
    assert model.unproven() == ""


@pytest.mark.parametrize("mode", Mode)
def test_a_clock_that_is_set_back_by_a_minute_does_not_wind_the_integrals_up(mode):
    pilot, fresh = autopilot(mode), autopilot(mode)
    for step in range(100):
        pilot.step(100.0 + 0.05 * step, heard(100.0 + 0.05 * step), ASK)
    for time_s in (40.0, 40.05):
        again, first = pilot.step(time_s, heard(time_s), ASK), fresh.step(time_s, heard(time_s), ASK)
        assert again.tau_pid == pytest.approx(first.tau_pid)
        assert again.pwm_us == pytest.approx(first.pwm_us)


@pytest.mark.parametrize(
    ("sensor", "axes", "says"),
    [
        ("velocity_time_s", (0, 1), "PID surge, sway off: no velocity"),
        ("depth_time_s", (2,), "PID heave off: no depth"),
        ("attitude_time_s", (5,), "PID roll, pitch, yaw off: no attitude"),
        ("rate_time_s", (5,), "PID roll, pitch, yaw off: no attitude"),
    ],
)
def test_a_sensor_that_fell_silent_steers_no_thruster(sensor, axes, says):
    pilot = autopilot(Mode.OFF)
    for step in range(60):
        pilot.step(0.05 * step, heard(0.05 * step), ASK)
    after = [pilot.step(t, heard(t, **{sensor: 3.0}), ASK) for t in (3.5, 4.0, 4.05, 7.95)]
    dropout, still, *blind = (actuation.tau_pid for actuation in after)
    assert all(tau[dof] != 0.0 for tau in (dropout, still) for dof in (0, 1, 2, 5))
    assert all(tau[dof] == 0.0 for tau in blind for dof in axes)
    assert all(tau[dof] != 0.0 for tau in blind for dof in {0, 1, 2, 5} - set(axes))
    assert pilot.take_texts() == [says]
    assert len(says) <= 50
    assert after[-1].nu_fb == (0.3, 0.1, 0.01, 0.001, 0.002, 0.05)
    assert pilot.step(8.0, heard(8.0), ASK).tau_pid[axes[0]] != 0.0


def test_a_clock_that_no_sensor_has_told_steers_no_thruster():
    actuation = autopilot(Mode.OFF).step(1.0, Navigation(), ASK)
    assert actuation.tau_pid == (0.0,) * 6
    assert set(actuation.pwm_us) == {1500.0}


@pytest.mark.parametrize("mode", Mode)
@pytest.mark.parametrize(
    ("sensor", "reading"),
    [("velocity_time_s", "velocity"), ("attitude_time_s", "heading"), ("rate_time_s", "heading")],
)
def test_without_velocity_or_heading_for_five_seconds_nothing_pushes_horizontally(mode, sensor, reading):
    pilot = autopilot(mode)
    for step in range(21):
        pilot.step(0.05 * step, heard(0.05 * step), ASK)
    before = pilot.step(5.95, heard(5.95, **{sensor: 1.0}), ASK)
    pushes = abs(before.tau_cmd[0]) > 1e-9
    assert pushes == (mode.applies_feedforward or reading == "heading")
    says = f"no {reading} for 5 s: no horizontal thrust"
    assert says not in pilot.take_texts()
    for time_s in (6.05, 30.0):
        held = pilot.step(time_s, heard(time_s, **{sensor: 1.0}), ASK)
        assert [held.tau_cmd[dof] for dof in (0, 1, 5)] == pytest.approx([0.0] * 3, abs=1e-9)
        assert held.tau_cmd[2] != 0.0
    assert pilot.take_texts() == [says]
    assert len(says) <= 50
    assert pilot.step(30.05, heard(30.05), ASK).tau_cmd[0] != 0.0


def test_a_velocity_never_heard_is_missed_from_the_first_armed_tick_on():
    pilot = autopilot(Mode.ALONE)
    for time_s in (0.0, 100.0):
        pilot.rest(time_s, heard(time_s, velocity_time_s=math.nan), ASK)
    pushes = [
        pilot.step(t, heard(t, velocity_time_s=math.nan), ASK).tau_cmd[0] for t in (101.0, 106.0, 106.1)
    ]
    assert [push != pytest.approx(0.0, abs=1e-9) for push in pushes] == [True, True, False]


def test_what_is_not_aboard_is_not_missed():
    bare = replace(FILE.vehicle, sensors=replace(FILE.vehicle.sensors, dvl=None))
    pilot = Autopilot(bare, "hovering", lambda _: MODEL, FILE.path.parent, Mode.ALONE)
    for time_s in (0.0, 60.0):
        assert pilot.step(time_s, heard(time_s, velocity_time_s=math.nan), ASK).tau_cmd[0] != 0.0


def rising(time_s: float) -> Reference:
    """Surge and yaw rise steadily, and the heading with it."""
    speed, rate = 0.2 + 0.08 * time_s, 0.05 + 0.02 * time_s
    return Reference(
        (speed, 0, 0, 0, 0, rate), (0.08, 0, 0, 0, 0, 0.02), 0.05 * time_s + 0.01 * time_s**2, 0.62
    )


def on_course(time_s: float, old_s: float) -> Navigation:
    """A vehicle that is where it should be, as readings `old_s` old tell it."""
    then = rising(time_s - old_s)
    velocity = (then.nu[0], 0.0, 0.0)
    known = replace(HERE, velocity=velocity, rate=(0.0, 0.0, then.nu[5]), heading_rad=then.heading_rad)
    times = dict.fromkeys(("velocity_time_s", "rate_time_s", "attitude_time_s"), time_s - old_s)
    return replace(known, depth_time_s=time_s, **times)


@pytest.mark.parametrize("old_s", [0.0, 0.07, 0.15])
def test_beside_the_feedforward_the_pid_leaves_a_vehicle_alone_that_was_on_course_when_it_was_read(old_s):
    both, off = autopilot(Mode.BOTH), autopilot(Mode.OFF)
    for step in range(5, 25):
        time_s = 0.05 * step
        left, pushed = (pilot.step(time_s, on_course(time_s, old_s), rising(time_s)) for pilot in (both, off))
    assert [left.tau_pid[dof] for dof in (0, 5)] == pytest.approx([0.0, 0.0], abs=0.1)
    assert (pushed.tau_pid[0] > 0.4) == (old_s > 0)


def test_together_the_feedforward_leads_by_lag_and_half_a_period_and_is_told_as_it_was_commanded():
    both, alone = autopilot(Mode.BOTH), autopilot(Mode.ALONE)
    for step in range(5, 25):
        time_s = 0.05 * step
        led, plain = (pilot.step(time_s, on_course(time_s, 0.0), rising(time_s)) for pilot in (both, alone))
    assert led.tau_ff == pytest.approx(plain.tau_ff)
    ahead = 0.075 * 56.24 * 0.08, 0.075 * 26.07 * 0.02
    assert [led.tau_cmd[dof] - led.tau_ff[dof] for dof in (0, 5)] == pytest.approx(ahead, abs=0.01)
    assert plain.tau_cmd[0] == pytest.approx(plain.tau_ff[0])


@pytest.mark.parametrize("mode", [Mode.ALONE, Mode.BOTH])
def test_small_thrusts_of_the_thrusters_that_the_feedforward_drives_pass_the_dead_zone(mode):
    level = Navigation((0.05, 0, 0), 0, (0.0, 0, 0), 0, (1.0, 0, 0, 0), 0.0, 0, 0.57, 0)
    pilot, slow = autopilot(mode), Reference((0.05, 0, 0, 0, 0, 0), (0.0,) * 6, 0.0, 0.6)
    whisper = [pilot.step(0.05 * step, level, slow) for step in range(11)][-1]
    curve = thrust_curve(FILE.vehicle.thrust_curve, FILE.path.parent)
    wrench = allocation_matrix(FILE.vehicle.configurations["hovering"]) @ curve.thrust(whisper.pwm_us)
    assert wrench[0] == pytest.approx(56.24 * 0.05)
    assert whisper.tau_cmd[2] > 3.0
    assert wrench[2] == 0.0


def applied(actuation: Actuation) -> tuple[float, ...]:
    """The feed-forward's force in surge, sway and yaw."""
    return tuple(actuation.tau_cmd[dof] - actuation.tau_pid[dof] for dof in (0, 1, 5))


NONE = pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


@pytest.mark.parametrize("mode", [Mode.ALONE, Mode.BOTH])
@pytest.mark.parametrize("made_s", [-10.0, 0.45, 2.1, math.inf, -math.inf])
def test_a_reference_of_another_time_feeds_nothing_forward_and_that_is_said_once(mode, made_s):
    pilot = autopilot(mode)
    for step in range(20):
        time_s = 0.05 * step
        assert pilot.step(time_s, heard(time_s), replace(ASK, time_s=time_s - 0.4)).tau_ff[0] > 0
    for time_s in (1.0, 1.05, 1.1):
        actuation = pilot.step(time_s, heard(time_s), replace(ASK, time_s=made_s))
        assert actuation.tau_ff == (0.0,) * 6
        assert applied(actuation) == NONE
        assert mode is Mode.ALONE or actuation.tau_pid[0] != 0.0
    assert pilot.take_texts() == ["FF off: the reference is stale"]
    again = pilot.step(1.15, heard(1.15), replace(ASK, time_s=1.15))
    assert again.tau_ff[0] > 0
    assert pilot.take_texts() == []


def test_a_reference_five_seconds_old_is_followed_no_more_and_depth_is_held():
    pilot = autopilot(Mode.OFF)
    for step in range(20):
        pilot.step(0.05 * step, heard(0.05 * step), replace(ASK, time_s=0.05 * step))
    held = pilot.step(5.9, heard(5.9), replace(ASK, time_s=0.95))
    assert held.tau_cmd[0] != 0.0
    let_go = pilot.step(6.0, heard(6.0), replace(ASK, time_s=0.95))
    assert [let_go.tau_cmd[dof] for dof in (0, 1, 5)] == NONE
    assert let_go.tau_cmd[2] != 0.0
    assert pilot.take_texts()[-1] == "no reference for 5 s: no horizontal thrust"


def test_a_reference_that_the_future_stamped_for_five_seconds_is_followed_no_more():
    pilot, ahead = autopilot(Mode.BOTH), replace(ASK, time_s=1e6)
    for step in range(100):
        assert pilot.step(0.05 * step, heard(0.05 * step), ahead).tau_cmd[0] != 0.0
    let_go = pilot.step(5.1, heard(5.1), ahead)
    assert [let_go.tau_cmd[dof] for dof in (0, 1, 5)] == NONE
    assert let_go.tau_cmd[2] != 0.0
    assert pilot.take_texts()[-1] == "no reference for 5 s: no horizontal thrust"
    assert pilot.step(5.15, heard(5.15), replace(ASK, time_s=5.15)).tau_cmd[0] != 0.0


@pytest.mark.parametrize("force", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(("dof", "axis"), [(0, "surge"), (2, "heave")])
def test_a_push_that_is_no_number_is_not_given_and_said_once(dof, axis, force):
    push = tuple(force if number == dof else None for number in range(6))
    wrong, unpushed = autopilot(Mode.SHADOW), autopilot(Mode.SHADOW)
    for time_s in (0.0, 0.05, 0.1):
        actuation = wrong.step(time_s, heard(time_s), replace(ASK, push=push))
        assert actuation.pwm_us == unpushed.step(time_s, heard(time_s), ASK).pwm_us
    assert wrong.take_texts() == [f"push in {axis} is no number: none given"]


def test_a_push_beyond_what_the_thrusters_reach_is_all_that_they_reach():
    beyond, most = (
        autopilot(Mode.SHADOW).step(0.0, heard(0.0), replace(ASK, push=(force, *(0.0,) * 5)))
        for force in (1e308, 132.34)
    )
    assert beyond.pwm_us == pytest.approx(most.pwm_us, rel=1e-3)
    assert beyond.tau_cmd == pytest.approx(most.tau_cmd, rel=1e-3, abs=1e-6)


@pytest.mark.parametrize(
    ("field", "value", "reading"),
    [
        ("velocity", (math.nan, 0.1, 0.0), "velocity"),
        ("velocity", (0.3, math.inf, 0.0), "velocity"),
        ("attitude", (math.nan,) * 4, "heading"),
        ("rate", (0.0, 0.0, math.inf), "heading"),
    ],
)
def test_readings_that_come_and_are_no_numbers_are_missed_like_silence(field, value, reading):
    pilot = autopilot(Mode.BOTH)
    for step in range(20):
        pilot.step(0.05 * step, heard(0.05 * step), ASK)
    for time_s in (1.0, 5.9):
        assert pilot.step(time_s, replace(heard(time_s), **{field: value}), ASK).tau_cmd[0] != 0.0
    for time_s in (6.0, 6.05):
        actuation = pilot.step(time_s, replace(heard(time_s), **{field: value}), ASK)
        assert [actuation.tau_cmd[dof] for dof in (0, 1, 5)] == NONE
    assert pilot.take_texts()[-1] == f"no {reading} for 5 s: no horizontal thrust"
    assert pilot.step(6.1, heard(6.1), ASK).tau_cmd[0] != 0.0


@pytest.mark.parametrize("sensor", ["velocity_time_s", "attitude_time_s", "rate_time_s"])
@pytest.mark.parametrize("stamped_s", [1e6, 60.0])
def test_readings_that_the_future_stamped_are_missed_like_silence(sensor, stamped_s):
    pilot = autopilot(Mode.BOTH)
    for step in range(100):
        assert pilot.step(0.05 * step, heard(0.05 * step, **{sensor: stamped_s}), ASK).tau_cmd[0] != 0.0
    let_go = pilot.step(5.1, heard(5.1, **{sensor: stamped_s}), ASK)
    assert [let_go.tau_cmd[dof] for dof in (0, 1, 5)] == NONE
    assert let_go.tau_cmd[2] != 0.0
    assert pilot.step(5.15, heard(5.15), ASK).tau_cmd[0] != 0.0


@pytest.mark.parametrize("mode", [Mode.ALONE, Mode.BOTH])
def test_raised_off_and_raised_again_the_feed_forward_grows_from_zero_and_ends_at_once(mode):
    pilot = autopilot(Mode.SHADOW)
    reach = 132.34
    for step in range(10):
        pilot.step(0.05 * step, heard(0.05 * step), ASK)
    for begin_s in (0.5, 1.05):
        pilot.mode = mode
        grown = [applied(pilot.step(t, heard(t), ASK))[0] for t in (begin_s + 0.05 * k for k in range(8))]
        assert grown[0] == pytest.approx(0.1 * reach, rel=1e-3)
        assert max(b - a for a, b in pairwise(grown)) <= 0.1 * reach * (1 + 1e-3)
        assert grown[-1] == pytest.approx(111.6 * 0.05 + 56.24 * 0.4)
        pilot.mode = Mode.OFF
        assert applied(pilot.step(begin_s + 0.5, heard(begin_s + 0.5), ASK)) == NONE


def test_a_coefficient_that_goes_bad_gives_zero_at_once_even_where_the_feed_forward_leads():
    model = dict(MODEL)
    pilot = autopilot(Mode.BOTH, model)
    for step in range(20):
        pilot.step(0.05 * step, heard(0.05 * step), ASK)
    model["M_u"] = math.nan
    actuation = pilot.step(1.0, heard(1.0), ASK)
    assert applied(actuation)[0] == pytest.approx(0.0, abs=1e-9)
    assert applied(actuation)[1] == pytest.approx(112.41 * 0.02 + 53.05 * 0.2)


def test_thrusters_that_rest_at_another_pulse_are_never_driven():
    curve = replace(FILE.vehicle.thrust_curve, neutral_us=1480.0)
    other = replace(FILE.vehicle, thrust_curve=curve)
    with pytest.raises(ConfigError, match="neutral_us is 1480"):
        Autopilot(other, "hovering", lambda _: MODEL, FILE.path.parent)
