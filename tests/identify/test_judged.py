"""What a recording without velocity, without pulses, of one axis or with slow commands still tells: dives of known mass
and damping, whose readings have next to no noise."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from bridge.errors import FitError
from bridge.vehicle.config import Configuration, ThrustCurve, Thruster, Vehicle, VehicleFile
from bridge.vehicle.thrusters import QuadraticCurve
from identify.diagnose.filters.nominal import nominal_of
from identify.diagnose.filters.slow_samples import late_samples_s, with_later_commands
from identify.diagnose.gap.simulation import simulation_of
from identify.diagnose.nominal_fit import fitted_nominal
from identify.dive import Dive, Signal
from identify.estimators.answer import answered
from identify.estimators.axes.build import build_axes
from identify.estimators.filter.state import POSITION
from identify.estimators.likelihood.answer import estimate
from identify.estimators.likelihood.start import start_of
from identify.ingest.commands import (
    logged_at_changes,
    sampled_seldom,
    sampled_slowly,
    spread,
    with_spread_commands,
)
from identify.ingest.rotation import quaternions_from_euler
from identify.thrust.wrench import wrench

HEAVE, YAW = 2, 5
MASS, DAMPING = {HEAVE: 40.0, YAW: 6.0}, {HEAVE: 30.0, YAW: 4.0}
SHAPE = Configuration(dry_mass_kg=25.0, inertia_kgm2=(2.0, 4.0, 5.0), thrusters=(), thruster_limit_n=20.0)
FILE = VehicleFile(
    Path("still.yaml"), Vehicle("still", {"only": SHAPE}, thrust_curve=ThrustCurve(lag_s=0.0)), None, "0" * 64
)
SECONDS, FINE_S = 80.0, 0.01


def moved(dof, changes_s, force):
    """Times, speed and place of one axis under forces (k,) from the times of their changes on, without noise."""
    time_s = np.arange(0.0, SECONDS, FINE_S)
    push = force[np.searchsorted(changes_s, time_s + 1e-9, side="right") - 1]
    keep = np.exp(-FINE_S * DAMPING[dof] / MASS[dof])
    speed = np.zeros(len(time_s))
    for k in range(1, len(time_s)):
        speed[k] = keep * speed[k - 1] + (1.0 - keep) * push[k - 1] / DAMPING[dof]
    index = np.concatenate([[0.0], np.cumsum(0.5 * FINE_S * (speed[1:] + speed[:-1]))])
    return time_s, speed, index


def steps(rng):
    """Irregular times of changes, and forces."""
    changes_s = np.concatenate([[0.0], np.cumsum(rng.uniform(1.0, 4.0, 60))])
    changes_s = changes_s[changes_s < SECONDS - 5.0]
    return changes_s, rng.choice([-4.0, -2.0, 0.0, 2.0, 4.0], len(changes_s)) + rng.uniform(
        -0.5, 0.5, len(changes_s)
    )


def commanded(dof, changes_s, force):
    six = np.zeros((len(changes_s), 6))
    six[:, dof] = force
    return Signal(changes_s, six)


def one_axis(dof, every=10, noise=1e-4, rate=False):
    """A dive of one axis: depth alone, heading alone, or rate of turn alone, and the wrench as it changed."""
    rng = np.random.default_rng(4)
    changes_s, force = steps(rng)
    time_s, speed, index = (part[::every] for part in moved(dof, changes_s, force))
    read = (speed if rate else index) + noise * rng.normal(size=len(time_s))
    dive = Dive("one axis", Path("one.csv"), "1" * 64, tau_cmd=commanded(dof, changes_s, force))
    if dof == HEAVE:
        return replace(dive, depth=Signal(time_s, read[:, None]))
    if rate:
        return replace(dive, gyro=Signal(time_s, np.column_stack([0.0 * read, 0.0 * read, read])))
    level = 0.0 * read
    return replace(dive, attitude=Signal(time_s, quaternions_from_euler(level, level, read)))


def fit(dive):
    recorded = with_spread_commands(dive)
    return answered(estimate(recorded, FILE, "only", lambda *_: None), recorded, FILE)


@pytest.mark.parametrize(
    ("dof", "rate", "names"),
    [(HEAVE, False, ("M_w", "D_w")), (YAW, False, ("I_r", "D_r")), (YAW, True, ("I_r", "D_r"))],
    ids=["depth alone", "heading alone", "rate of turn alone"],
)
def test_one_axis_alone_is_identified(dof, rate, names):
    answer = fit(one_axis(dof, rate=rate))
    for name, truth in zip(names, (MASS[dof], DAMPING[dof]), strict=True):
        assert answer[name].identifiable
        assert answer[name].value == pytest.approx(truth, rel=0.02)
    others = [parameter for parameter in answer.parameters[:12] if parameter.name not in names]
    assert not any(parameter.identifiable for parameter in others)
    assert answer["M_u"].reason == "no velocity in surge was recorded; record the DVL"


@pytest.mark.parametrize(("every_s", "is_doubted"), [(0.5, True), (0.1, False), (None, False)])
def test_seldom_samples_of_the_commands_leave_a_warning_and_changes_as_they_come_or_frequent_samples_none(
    every_s, is_doubted
):
    dive = one_axis(YAW, rate=True)
    if every_s is not None:
        time_s = np.arange(0.0, SECONDS, every_s)
        dive = replace(dive, tau_cmd=Signal(time_s, dive.tau_cmd.held_at(time_s)))
    answer = fit(dive)
    doubted = [doubt.about for doubt in answer.doubts if "samples 0.5 s apart" in doubt.sentence]
    assert doubted == [("I_r", "D_r")] * is_doubted


def test_a_depth_that_hardly_stands_out_of_its_noise_says_nothing_of_heave():
    built = build_axes(with_spread_commands(one_axis(HEAVE, noise=0.5)), FILE, "only")
    assert built.axes == ()
    assert built.missing[HEAVE] == (
        "no velocity in heave was recorded, and depth alone does not determine it; record the DVL"
    )


def test_a_place_that_no_thruster_moved_is_not_judged():
    dive = one_axis(HEAVE)
    drift = 0.01 * np.arange(len(dive.depth))
    level = 0.0 * drift
    turned = Signal(dive.depth.time_s, quaternions_from_euler(level, level, drift))
    built = build_axes(with_spread_commands(replace(dive, attitude=turned)), FILE, "only")
    assert [axis.dof for axis in built.axes] == [HEAVE]
    assert (built.axes[0].state_read[np.isfinite(built.axes[0].reading)] == POSITION).all()
    assert built.missing[YAW] == "the thrusters never pushed in yaw, and attitude alone was read there"


def test_commands_that_come_as_they_change_hold_until_the_next_and_to_the_end():
    commands = commanded(YAW, np.array([0.0, 3.1, 4.0, 9.7]), np.array([1.0, -1.0, 2.0, 0.5]))
    assert logged_at_changes(commands)
    held = spread(commands, 12.0)
    assert held.time_s[[0, -1]].tolist() == [0.0, 12.0]
    assert np.diff(held.time_s).max() <= 0.1 + 1e-9
    at_s = np.array([0.0, 3.05, 3.15, 9.65, 9.75, 11.9])
    assert held.held_at(at_s)[:, YAW].tolist() == [1.0, 1.0, -1.0, 2.0, 0.5, 0.5]


def test_a_clock_s_samples_are_no_changes_and_quick_ones_hold():
    time_s = np.arange(0.0, 30.0, 0.5)
    changing = commanded(YAW, time_s, np.sin(time_s))
    assert sampled_slowly(changing)
    lost = np.delete(np.arange(len(time_s)), [5, 6, 20])
    assert sampled_slowly(Signal(time_s[lost], changing.value[lost]))
    often = commanded(YAW, time_s / 5, np.sin(time_s))
    assert sampled_slowly(often)
    assert not sampled_seldom(often)
    quick = commanded(YAW, time_s / 10, np.sin(time_s))
    assert not sampled_slowly(quick)
    assert not logged_at_changes(quick)
    pressed = commanded(YAW, 10.0 * np.arange(12), np.arange(12.0))
    assert logged_at_changes(pressed)


def test_between_slow_samples_the_wrench_changes_evenly_and_what_it_hides_is_a_force():
    time_s = np.arange(0.0, 30.0, 0.5)
    dive = replace(one_axis(YAW), tau_cmd=commanded(YAW, time_s, 2.0 * (np.arange(len(time_s)) % 2)))
    forces = wrench(dive, FILE, "only")
    mean = forces.mean_between(np.array([1.0, 1.0]), np.array([1.5, 2.0]))[:, YAW]
    np.testing.assert_allclose(mean, 1.0)
    assert forces.sampled_s == pytest.approx(0.5)
    assert forces.hidden[YAW] == pytest.approx(2.0 * np.sqrt(0.5 / 12.0))
    assert "a delay or a lag of the thrusters can't be judged" in forces.notes[-1]


def pushed_by(pulses_us: list[float], every_s: float = 0.1) -> Dive:
    """A dive of one thruster that turns, its pulses sampled."""
    time_s = every_s * np.arange(len(pulses_us))
    return replace(one_axis(YAW), tau_cmd=None, pwm=Signal(time_s, np.array(pulses_us)[:, None]))


DEAD_US = 30.0
TURNING = Configuration(
    dry_mass_kg=25.0,
    inertia_kgm2=(2.0, 4.0, 5.0),
    thrusters=(Thruster((0.0, 1.0, 0.0), (1.0, 0.0, 0.0)),),
    thruster_limit_n=20.0,
)
CURVE = ThrustCurve(kind="quadratic", max_n=20.0, dead_band_us=DEAD_US)
TURNED = VehicleFile(
    Path("turned.yaml"), Vehicle("turned", {"only": TURNING}, thrust_curve=CURVE), None, "0" * 64
)


def test_between_slow_samples_a_pulse_leaves_the_dead_zone_on_its_way():
    rising = [1500.0 + 10.0 * k for k in range(60)]
    forces = wrench(pushed_by(rising), TURNED, "only")
    assert forces.sampled_s == pytest.approx(0.1)
    curve = QuadraticCurve(20.0, 400.0, DEAD_US)
    truth_nm = curve.thrust(np.linspace(1530.0, 1540.0, 2001)).mean()
    assert forces.mean_between(np.array([0.3]), np.array([0.4]))[0, YAW] == pytest.approx(truth_nm, rel=0.01)
    # Thrust that goes straight to its next sample would be a third less.
    assert curve.thrust([1530.0, 1540.0]).mean() < 0.7 * truth_nm


def test_where_pulses_jump_between_slow_samples_the_mean_thrust_is_halfway():
    jump = [1500.0] * 30 + [1900.0] * 30
    forces = wrench(pushed_by(jump), TURNED, "only")
    assert forces.mean_between(np.array([2.9]), np.array([3.0]))[0, YAW] == pytest.approx(10.0)


def test_samples_of_a_steady_change_hide_nothing():
    time_s = np.arange(0.0, 30.0, 0.2)
    forces = wrench(replace(one_axis(YAW), tau_cmd=commanded(YAW, time_s, 0.3 * time_s)), FILE, "only")
    assert forces.sampled_s == pytest.approx(0.2)
    assert forces.hidden[YAW] == pytest.approx(0.0, abs=1e-9)
    assert forces.notes[-1] == "The wrench is TAU_CMD as recorded."


def test_slow_samples_of_a_quick_command_still_tell_of_yaw():
    dive = one_axis(YAW, rate=True, noise=1e-3)
    time_s = np.arange(0.0, SECONDS, 0.5)
    answer = fit(replace(dive, tau_cmd=Signal(time_s, dive.tau_cmd.held_at(time_s))))
    for name, truth in (("I_r", MASS[YAW]), ("D_r", DAMPING[YAW])):
        assert answer[name].low95 < truth < answer[name].high95
        assert answer[name].identifiable


def test_a_dive_in_which_nothing_was_pushed_is_refused_and_gives_no_value():
    dive = with_spread_commands(one_axis(YAW, rate=True))
    idle = replace(dive, tau_cmd=Signal(dive.tau_cmd.time_s, 0.0 * dive.tau_cmd.value))
    unarmed = replace(dive, armed=Signal(np.array([0.0, 50.0]), np.zeros((2, 1))))
    for still, words in (
        (idle, "no thruster pushed in all the dive"),
        (unarmed, "the vehicle was never armed"),
    ):
        with pytest.raises(FitError, match=f"one axis: {words}"):
            estimate(still, FILE, "only", lambda *_: None)
    assert estimate(dive, FILE, "only", lambda *_: None)["I_r"].identifiable


def test_slow_commands_that_hold_push_a_model_as_late_as_they_did():
    time_s = np.arange(0.0, SECONDS - 1.0, 0.5)
    force = 4.0 * np.sin(0.4 * time_s + 0.008 * time_s**2)
    at_s, speed, _ = (part[::10] for part in moved(YAW, time_s, force))
    gyro = Signal(at_s, np.column_stack([0.0 * at_s, 0.0 * at_s, speed]))
    dive = Dive("slow", Path("slow.csv"), "1" * 64, tau_cmd=commanded(YAW, time_s, force), gyro=gyro)
    late_s = late_samples_s(start_of(build_axes(dive, FILE, "only"), SHAPE))
    assert late_s == pytest.approx(0.25, abs=0.06)
    assert with_later_commands(dive, late_s).tau_cmd.time_s[0] == late_s
    model = nominal_of(dive, FILE, "only")
    lacking = simulation_of(model, model.theta, model.motion.nu).lacking[:, YAW]
    assert np.std(lacking) < 0.2 * np.std(force)


def five_a_second(force, late_s):
    """A dive whose commands change 20 times a second, act `late_s` later, and were recorded 5 times a second."""
    fine_s = 0.05 * np.arange(len(force))
    at_s, speed, _ = (part[::10] for part in moved(YAW, fine_s, force))
    gyro = Signal(at_s + late_s, np.column_stack([0.0 * at_s, 0.0 * at_s, speed]))
    recorded = commanded(YAW, fine_s[::4], force[::4])
    return Dive("fast", Path("fast.csv"), "1" * 64, tau_cmd=recorded, gyro=gyro)


@pytest.mark.parametrize("true_s", [0.0, 0.3])
def test_thrust_of_a_fast_loop_that_was_sampled_slowly_is_late_by_its_delay_alone(true_s):
    force = np.repeat(np.random.default_rng(3).uniform(-6.0, 6.0, 230), 7)[:1580]
    assert fitted_nominal(five_a_second(force, true_s), FILE, "only").late_thrust_s == (true_s, 0.0)


def test_a_delay_beyond_what_sampling_makes_is_left_for_the_causes():
    time_s = 0.05 * np.arange(1580)
    dive = five_a_second(4.0 * np.sin(0.4 * time_s + 0.008 * time_s**2), 0.3)
    assert late_samples_s(start_of(build_axes(dive, FILE, "only"), SHAPE)) > 0.15
    (recorded,), (fitted,) = build_axes(dive, FILE, "only").axes, nominal_of(dive, FILE, "only").built.axes
    np.testing.assert_array_equal(fitted.force, recorded.force)


def test_quick_commands_are_as_late_as_they_were():
    dive = with_spread_commands(one_axis(YAW, rate=True))
    assert late_samples_s(start_of(build_axes(dive, FILE, "only"), SHAPE)) == 0.0


def test_the_axes_tell_together_how_late_slow_commands_are_each_by_what_it_knows_and_one_prior_for_all():
    """Information of 30 and 60 beside a prior of 10; an axis whose readings were filtered tells nothing of it."""
    axis, coloured = (
        SimpleNamespace(sampled_s=0.2, timing=("delay",), is_coloured=is_so) for is_so in (False, True)
    )
    known = [SimpleNamespace(axis=each, noise_index=3) for each in (axis, axis, coloured)]
    theta, information = np.zeros(12), np.zeros((12, 12))
    theta[[2, 6, 10]] = 0.1, 0.4, 9.0
    information[[2, 6, 10], [2, 6, 10]] = 30.0, 60.0, 90.0
    joint = SimpleNamespace(
        problems=known, slices=[slice(4 * k, 4 * k + 4) for k in range(3)], prior_precision=np.full(12, 10.0),
        score=lambda _: (None, information),
    )  # fmt: skip
    assert late_samples_s(SimpleNamespace(joint=joint, theta=theta)) == pytest.approx(
        ((30.0 + 10.0) * 0.1 + (60.0 + 10.0) * 0.4) / (30.0 + 60.0 + 10.0)
    )
