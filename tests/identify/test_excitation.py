"""What a dive could identify is told before anyone fits anything, and told as the fit will tell it."""

import math
from dataclasses import replace

import closed_loop
import numpy as np
import pytest

from bridge.vehicle.coefficients import COEFFICIENTS
from bridge.vehicle.config import load_vehicle
from identify.dive import Dive, Signal
from identify.estimators.table import estimator
from identify.glance.excitation import excitation, spans
from identify.planning.information import of_axis, of_forces
from identify.planning.knowledge import AxisNoise

FILE = closed_loop.vehicle_file()
HEAVY = load_vehicle("bluerov2_heavy")


@pytest.fixture(scope="module")
def dive():
    return closed_loop.dive(np.random.default_rng(100_003))


def told(dive: Dive) -> dict[str, float]:
    return {one.name: one.relative_std for one in excitation(dive, FILE, "only").coefficients}


def test_it_foretells_the_standard_errors_of_the_likelihood(dive):
    fit = estimator("likelihood")(dive, FILE, "only", lambda *_: None)
    found = {one.name: one.std / one.value for one in fit.parameters}
    foretold = told(dive)
    for name in ("M_u", "D_u"):
        assert foretold[name] == pytest.approx(found[name], rel=0.4)


def test_all_twelve_are_told_in_their_order_and_axes_without_thrust_are_unknown(dive):
    found = excitation(dive, FILE, "only")
    assert [one.name for one in found.coefficients] == [c.name for c in COEFFICIENTS]
    assert [one.name for one in found.coefficients if one.identifiable] == ["M_u", "D_u"]
    assert {one.relative_std for one in found.coefficients if not one.identifiable} == {math.inf}


def test_sensor_noise_at_rest_identifies_nothing(dive):
    still = replace(dive, tau_cmd=Signal(dive.tau_cmd.time_s, np.zeros_like(dive.tau_cmd.value)))
    assert set(told(still).values()) == {math.inf}


def test_a_dive_twice_as_long_tells_root_two_more():
    short, long = (closed_loop.dive(np.random.default_rng(100_004), seconds=s) for s in (200.0, 400.0))
    assert told(short)["M_u"] / told(long)["M_u"] == pytest.approx(math.sqrt(2), rel=0.15)


def test_half_the_thrust_tells_about_half_as_much(dive):
    weak = replace(dive, tau_cmd=Signal(dive.tau_cmd.time_s, 0.5 * dive.tau_cmd.value))
    # Not quite half: half a millisecond of doubt about the thrust's time weighs on both alike.
    assert told(weak)["D_u"] / told(dive)["D_u"] == pytest.approx(2.0, rel=0.2)


def test_what_was_not_read_tells_nothing(dive):
    velocity = dive.velocity.value.copy()
    velocity[: len(velocity) * 3 // 4] = np.nan
    blind = replace(dive, velocity=Signal(dive.velocity.time_s, velocity))
    assert told(blind)["M_u"] / told(dive)["M_u"] == pytest.approx(2.0, rel=0.25)


def test_a_recording_that_ends_in_motion_tells_no_more_than_one_that_stopped(dive):
    time_s = dive.velocity.time_s

    def pushed(until_s):
        wrench = np.zeros((len(time_s), 6))
        wrench[(time_s > 150) & (time_s < until_s), 0] = 20.0
        return told(replace(dive, tau_cmd=Signal(time_s, wrench)))

    # One start instead of a start and a stop.
    assert pushed(400.0)["M_u"] / pushed(280.0)["M_u"] == pytest.approx(math.sqrt(2), rel=0.15)


def test_thrust_that_holds_against_buoyancy_all_the_time_tells_nothing(dive):
    held = np.zeros((len(dive.tau_cmd.time_s), 6))
    held[:, 0] = 5.0
    assert set(told(replace(dive, tau_cmd=Signal(dive.tau_cmd.time_s, held))).values()) == {math.inf}


def test_a_dive_without_commands_without_readings_or_too_short_says_why(dive):
    for less, why in (
        (replace(dive, tau_cmd=None), "neither thruster commands"),
        (replace(dive, velocity=None), "no axis has thrust and readings of motion together for 20 s"),
        (dive.between(0.0, 15.0), "no axis has thrust and readings"),
        (replace(dive, tau_cmd=Signal(*thinned(dive.tau_cmd, 5))), "thruster commands come at 2.0 Hz"),
    ):
        found = excitation(less, FILE, "only")
        assert why in found.note
        assert not any(one.identifiable for one in found.coefficients)


def thinned(signal: Signal, every: int):
    return signal.time_s[::every], signal.value[::every]


def test_roll_and_pitch_are_known_by_how_they_swing():
    rng, time_s = np.random.default_rng(100_005), np.arange(0.0, 300.0, 0.05)
    gyro = Signal(time_s, 0.01 * rng.normal(size=(len(time_s), 3)))
    idle = Dive("idle", FILE.path, "1" * 64, gyro=gyro, tau_cmd=Signal(time_s, np.zeros((len(time_s), 6))))
    found = {one.name: one for one in excitation(idle, HEAVY, "heavy").coefficients}
    assert found["I_p"].identifiable
    assert not found["I_r"].identifiable
    assert not found["M_u"].identifiable


def test_a_mass_is_known_by_what_it_does_to_the_other_axes():
    time_s = np.arange(0.0, 300.0, 0.05)
    yaw = 0.2 * np.sin(2 * np.pi * time_s / 20.0)
    sway = 0.05 * np.cos(2 * np.pi * time_s / 20.0)
    wrench = np.zeros((len(time_s), 6))
    wrench[:, 0] = 10.0 * np.sin(2 * np.pi * time_s / 13.0)
    wrench[:, 5] = 2.0 * np.sin(2 * np.pi * time_s / 20.0)
    rng = np.random.default_rng(100_007)

    def found(sway):
        velocity = np.column_stack([np.zeros(len(time_s)), sway, np.zeros(len(time_s))])
        dive = Dive(
            "turning",
            FILE.path,
            "1" * 64,
            velocity=Signal(time_s, velocity + 0.004 * rng.normal(size=velocity.shape)),
            gyro=Signal(time_s, np.column_stack([0 * yaw, 0 * yaw, yaw])),
            tau_cmd=Signal(time_s, wrench),
        )
        return told(dive)["M_v"]

    # Surge feels M_v v r where the vehicle drifts as it turns, and its thrust weighs that.
    assert found(sway) < 0.3
    assert found(0 * sway) > 1.0


def test_what_forces_tell_is_what_their_motion_does():
    """Of one axis alone, the information of forces and that of a motion are the same sum."""
    noise, step_s, rng = AxisNoise(0.35, 1.5, 1.6e-6), 0.05, np.random.default_rng(100_008)
    velocity = np.cumsum(rng.normal(size=4000)) * np.hanning(4000)
    jw = 2j * np.pi * np.fft.rfftfreq(4000, step_s)
    slope = np.fft.irfft(jw * np.fft.rfft(velocity), 4000)
    of_mass, of_damping = of_axis(step_s, velocity, 100.0, 50.0, noise)
    told = of_forces(step_s, np.column_stack([100.0 * slope, 50.0 * velocity]), 100.0, 50.0, noise)
    assert np.diag(told) == pytest.approx([of_mass, of_damping])
    assert told[0, 1] == pytest.approx(0.0, abs=1e-6 * of_mass)


def test_json_has_null_for_what_is_not_known(dive):
    data = excitation(dive, FILE, "only").to_json()
    assert data["coefficients"][1] == {"name": "M_v", "relative_std": None, "identifiable": False}
    assert data["coefficients"][0]["identifiable"] is True


def test_spans_are_seconds_thrust_and_speed_of_each_axis(dive):
    surge, sway, *_, yaw = spans(dive)
    assert surge.seconds == pytest.approx(300.0, abs=0.5)
    assert surge.speed == pytest.approx(0.8, abs=0.15)
    assert surge.thrust == pytest.approx(np.ptp(np.percentile(dive.tau_cmd.value[:, 0], (1, 99))))
    assert sway.thrust == 0.0
    assert (yaw.seconds, math.isnan(yaw.speed)) == (0.0, True)


def test_spans_take_thrust_from_the_thrusters_where_no_wrench_is_recorded(dive):
    time_s = dive.velocity.time_s
    pwm = np.where((time_s // 10) % 2, 1600.0, 1400.0)[:, None]
    with_pwm = replace(dive, tau_cmd=None, pwm=Signal(time_s, pwm))
    assert math.isnan(spans(with_pwm)[0].thrust)
    assert spans(with_pwm, FILE, "only")[0].thrust > 5.0
