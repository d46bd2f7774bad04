"""Go or no-go for the feed-forward, on dives whose vehicle is known exactly, in one mode or several."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from bridge.errors import ConfigError, FitError
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.mode import Mode
from bridge.vehicle.references import DoubleS
from bridge.vehicle.thrusters import Allocator, thrust_curve
from identify.dive import Dive, Signal
from identify.run.validate import validate
from identify.validation.axis_criteria import Criterion
from identify.validation.raising import Raising, go_no_go, in_one_mode

RATE_HZ = 10.0
FILE = load_vehicle("ruvifist")
TRUTH = {0: (100.0, 50.0, 0.4), 1: (120.0, 60.0, 0.3), 5: (16.0, 26.0, 0.2)}
"""By degree of freedom: mass, damping, and the speed that is asked for."""

PLACE = {0: 0, 1: 1, 5: 2}
LAG_S = 1.0


def _runs(top, first_s, count):
    """Speed and its derivative: up in 5 s, held for 10 s, down in 5 s, and the same backwards."""
    velocity, slope = np.zeros(count), np.zeros(count)
    for begins_s, sign in ((first_s, 1.0), (first_s + 25.0, -1.0)):
        up, down = DoubleS(0.0, sign * top, 5.0), DoubleS(sign * top, 0.0, 5.0)
        for k in range(count):
            t = k / RATE_HZ - begins_s
            if 0 <= t < 20:
                at = up.at(t) if t < 15 else down.at(t - 15)
                velocity[k], slope[k] = at[0], at[1]
    return velocity, slope


@cache
def flown(mode, mass=1.0, damping=1.0, axes=(0, 1, 5)):
    """A dive whose motion comes `LAG_S` late behind its reference as a first-order lag does; the PID gives just what
    that motion takes, and the feed-forward goes by `mass` and `damping` times the truth."""
    count = int(180 * RATE_HZ)
    time_s = np.arange(count) / RATE_HZ
    reference = np.zeros((count, 14))
    nu, pid, ff = (np.zeros((count, 6)) for _ in range(3))
    for dof in axes:
        mass_kg, d, top = TRUTH[dof]
        wanted, slope = _runs(top, 10.0 + 55.0 * PLACE[dof], count)
        reference[:, dof], reference[:, 6 + dof] = wanted, slope
        motion = np.zeros(count)
        for k in range(1, count):
            motion[k] = motion[k - 1] + (wanted[k - 1] - motion[k - 1]) / (LAG_S * RATE_HZ)
        nu[:, dof] = motion
        pid[:, dof] = mass_kg * np.gradient(motion, 1 / RATE_HZ) + d * motion
        ff[:, dof] = mass * mass_kg * slope + damping * d * wanted
    flat = np.full((count, 1), float(mode))
    commanded = {Mode.ALONE: ff, Mode.BOTH: pid + ff}.get(mode, pid)
    return Dive(
        "d", Path("d.tlog"), "0",
        velocity=Signal(time_s, nu[:, :3]), gyro=Signal(time_s, nu[:, 3:]), nu_ref=Signal(time_s, reference),
        tau_pid=Signal(time_s, pid), tau_ff=Signal(time_s, ff), tau_cmd=Signal(time_s, commanded),
        ff_mode=Signal(time_s, flat),
    )  # fmt: skip


def under(dive, pid, *, with_fed=False):
    """The dive under another force of the PID, commanded alone or with what is fed forward."""
    assert dive.tau_ff is not None
    time_s = dive.tau_ff.time_s
    commanded = pid + dive.tau_ff.value if with_fed else pid
    return replace(dive, tau_pid=Signal(time_s, pid), tau_cmd=Signal(time_s, commanded))


def judged(dive):
    raising = go_no_go(dive, FILE, "hovering")
    assert raising is not None
    return raising


def failed(raising):
    return [criterion.quantity for criterion in raising.criteria if criterion.passed is False]


@pytest.mark.parametrize("mode", [Mode.OFF, Mode.SHADOW])
def test_a_feed_forward_that_asks_for_what_the_motion_takes_is_a_go_however_late_the_pid_is(mode):
    raising = judged(flown(mode))
    assert raising.go
    assert all(criterion.passed for criterion in raising.criteria)
    assert "may be raised" in raising.sentence
    assert raising.sentence.endswith("to both (seatrial ff both, in the app Ctrl-U).")


def test_commands_whose_times_come_twice_are_judged_as_those_that_come_once():
    dive = flown(Mode.SHADOW)
    commanded = Signal(np.repeat(dive.tau_cmd.time_s, 2), np.repeat(dive.tau_cmd.value, 2, axis=0))
    assert judged(replace(dive, tau_cmd=commanded)) == judged(dive)


def without(signal, column):
    value = signal.value.copy()
    value[:, column] = np.nan
    return Signal(signal.time_s, value)


def test_what_was_never_read_of_roll_pitch_and_heave_leaves_the_other_axes_judged():
    dive = flown(Mode.SHADOW)
    rolls, heaves = without(dive.gyro, 0), without(dive.velocity, 2)
    for less in (replace(dive, gyro=rolls), replace(dive, velocity=heaves)):
        assert [(c.quantity, c.passed) for c in judged(less).criteria] == [
            (c.quantity, c.passed) for c in judged(dive).criteria
        ]


def test_an_axis_whose_speed_was_never_read_is_not_known():
    dive = flown(Mode.SHADOW)
    raising = judged(replace(dive, velocity=without(dive.velocity, 0)))
    assert raising.go
    assert [c.words for c in raising.criteria if c.passed is None] == [
        "no speed was measured there: nothing is known of it"
    ]


def test_the_pids_force_shows_mass_and_damping_as_they_are():
    words = {criterion.quantity: criterion.words for criterion in judged(flown(Mode.SHADOW)).criteria}
    # The lever arm of the DVL turns a yaw rate into a little sway, and the filter rounds the corners: three digits.
    assert words["surge mass"].startswith("100 kg fed, PID 100 ±")
    assert words["surge damping"].startswith("50.0 N/(m/s) fed, PID 50.0 ±")
    assert words["yaw damping"].startswith("26.0 N m/(rad/s) fed, PID 26.0 ±")


def test_the_mass_of_a_heavy_vehicle_is_written_out():
    dive = flown(Mode.SHADOW)
    heavy = [Signal(tau.time_s, 120.0 * tau.value) for tau in (dive.tau_pid, dive.tau_ff)]
    of_it = under(replace(dive, tau_ff=heavy[1]), heavy[0].value)
    words = {criterion.quantity: criterion.words for criterion in judged(of_it).criteria}
    assert words["surge mass"].startswith("12000 kg fed, PID 12000 ± ")


@pytest.mark.parametrize("factor", [0.5, 2.0])
@pytest.mark.parametrize("term", ["mass", "damping"])
def test_a_mass_or_damping_of_half_or_twice_is_named_and_is_no_go(term, factor):
    raising = judged(flown(Mode.SHADOW, **{term: factor}))
    assert failed(raising) == [f"{axis} {term}" for axis in ("surge", "sway", "yaw")]
    named = ", ".join(failed(raising))
    assert raising.sentence.startswith(f"NO-GO, don't raise it: {named}. Identify from")


def test_a_damping_that_the_pid_shows_with_the_other_sign_is_no_go_and_has_no_ratio():
    dive = flown(Mode.SHADOW)
    pid = dive.tau_pid.value.copy()
    pid[:, 0] -= 2 * 50.0 * dive.velocity.value[:, 0]
    (words,) = (c.words for c in judged(under(dive, pid)).criteria if c.quantity == "surge damping")
    assert "surge damping" in failed(judged(under(dive, pid)))
    assert words.startswith("50.0 N/(m/s) fed, PID −50.0 ± ")
    assert words.endswith(": of the other sign (0.71 to 1.41)")


def test_a_dive_at_rest_or_without_its_feed_forward_is_no_go():
    assert failed(judged(flown(Mode.SHADOW, axes=()))) == ["motion"]
    assert failed(judged(replace(flown(Mode.SHADOW), tau_ff=None))) == ["TAU_FF"]


@pytest.mark.parametrize(("factor", "go"), [(0.72, True), (0.70, False), (1.40, True), (1.43, False)])
def test_the_limits_lie_at_the_square_root_of_the_factor_of_two_that_was_flown(factor, go):
    assert judged(flown(Mode.SHADOW, damping=factor)).go is go


def test_a_force_that_no_feed_forward_knows_is_unlike():
    dive = flown(Mode.SHADOW)
    pushed = dive.tau_pid.value.copy()
    pushed[:, 0] += 20.0 * np.sin(2 * np.pi * dive.tau_pid.time_s / 12.0)
    raising = judged(under(dive, pushed))
    assert "surge likeness" in failed(raising)


@pytest.mark.parametrize(("seconds", "go"), [(1.9, True), (2.2, False)])
def test_a_dive_in_which_thrusters_were_pushed_beside_the_controller_tells_nothing_and_says_how_to_fly(
    seconds, go
):
    dive = flown(Mode.SHADOW)
    assert dive.tau_cmd is not None
    commanded = dive.tau_cmd.value.copy()
    commanded[: round(seconds * RATE_HZ), 1] += 30.0
    raising = judged(replace(dive, tau_cmd=Signal(dive.tau_cmd.time_s, commanded)))
    assert raising.go is go
    assert go or raising.sentence.endswith(
        "motion. Fly a minute by its controller: by hand, or the validation mission."
    )


def test_an_axis_that_an_autopilot_holds_later_is_not_pushed_beside_the_controller():
    """Flown by sticks in MANUAL, then in STABILIZE: the companion has no say over that axis any more."""
    dive = flown(Mode.SHADOW)
    assert dive.tau_pid is not None
    pid, time_s = dive.tau_pid.value.copy(), dive.tau_pid.time_s
    pid[time_s > 75.0, 0] = 0.0
    commanded = pid.copy()
    commanded[:, 0] += np.where(time_s > 75.0, 5.0 * np.sign(np.sin(time_s)), 0.0)
    assert judged(replace(dive, tau_pid=Signal(time_s, pid), tau_cmd=Signal(time_s, commanded))).go


def left_alone(force, begin_s, end_s):
    """In shadow, surge without the controller for a while, and commanded by somebody else: `force` of time, N."""
    dive = flown(Mode.SHADOW)
    assert dive.tau_pid is not None
    time_s, pid = dive.tau_pid.time_s, dive.tau_pid.value.copy()
    alone = (time_s > begin_s) & (time_s < end_s)
    pid[alone, 0] = 0.0
    commanded = pid.copy()
    commanded[alone, 0] = force(time_s[alone])
    return replace(dive, tau_pid=Signal(time_s, pid), tau_cmd=Signal(time_s, commanded))


def test_a_short_while_in_which_an_autopilot_holds_an_axis_is_no_push_and_a_force_that_is_held_is():
    def holds(time_s):
        return 6.0 * np.sin(time_s / 0.9) + 2.0 * np.sin(time_s / 0.3)

    assert judged(left_alone(holds, 80.0, 110.0)).go
    pushes = judged(left_alone(lambda time_s: 12.0 * np.sign(np.sin(time_s / 1.5)), 80.0, 110.0))
    assert failed(pushes) == ["motion"]
    assert "thrusters were pushed beside the controller" in pushes.criteria[0].words


@pytest.mark.parametrize(("seconds", "count", "go"), [(0.5, 40, True), (1.5, 2, False)])
def test_taps_of_the_sticks_are_no_push_however_many(seconds, count, go):
    dive = flown(Mode.SHADOW)
    assert dive.tau_cmd is not None
    time_s, commanded = dive.tau_cmd.time_s, dive.tau_cmd.value.copy()
    rests_s = 80.0 + 3.0 * np.arange(count) % 30.0
    for begin_s in rests_s:
        commanded[(time_s >= begin_s) & (time_s < begin_s + seconds), 0] += 30.0
    assert judged(replace(dive, tau_cmd=Signal(time_s, commanded))).go is go


def test_an_axis_that_the_feed_forward_leaves_at_zero_is_no_go_and_says_what_to_read():
    dive = flown(Mode.SHADOW)
    zeroed = dive.tau_ff.value.copy()
    zeroed[:, 1] = 0.0
    raising = judged(replace(dive, tau_ff=Signal(dive.tau_ff.time_s, zeroed)))
    assert failed(raising) == ["sway not fed"]
    assert "upload a set that it can fly" in raising.sentence


def test_a_baseline_that_feeds_nothing_forward_is_neither_go_nor_no_go():
    for mode, judges in ((Mode.OFF, False), (Mode.SHADOW, True)):
        dive = flown(mode)
        assert dive.tau_ff is not None
        nothing = replace(dive, tau_ff=Signal(dive.tau_ff.time_s, 0.0 * dive.tau_ff.value))
        assert (go_no_go(nothing, FILE, "hovering") is not None) is judges


def test_an_axis_that_was_not_driven_is_told_as_unknown_and_stops_nothing():
    raising = judged(flown(Mode.SHADOW, axes=(0, 5)))
    assert raising.go
    assert raising.sentence.endswith("Not known from this dive: sway.")


def test_a_force_that_the_thrusters_hardly_have_is_no_go():
    dive = flown(Mode.SHADOW)
    assert dive.tau_pid is not None
    much = {"tau_ff": Signal(dive.tau_ff.time_s, 6 * dive.tau_ff.value)}
    assert "thrusters" in failed(judged(replace(dive, **much)))
    assert "thrusters" not in failed(judged(dive))
    held_back = replace(dive, tau_cmd=Signal(dive.tau_pid.time_s, 0.3 * dive.tau_pid.value))
    assert "motion" not in failed(judged(held_back))


def test_nothing_is_said_of_a_recording_without_a_mode_or_a_reference():
    dive = flown(Mode.SHADOW)
    assert go_no_go(replace(dive, ff_mode=None), FILE, "hovering") is None
    assert go_no_go(replace(dive, nu_ref=None), FILE, "hovering") is None


def test_of_a_dive_in_two_modes_the_longer_part_is_judged():
    shadow, off = flown(Mode.SHADOW), flown(Mode.BOTH, damping=2.0)
    late = shadow.ff_mode.time_s > 120.0
    mode = np.where(late, 3.0, 1.0)[:, None]
    fed = np.where(late[:, None], off.tau_ff.value, shadow.tau_ff.value)
    both = replace(
        shadow,
        ff_mode=Signal(shadow.ff_mode.time_s, mode),
        tau_ff=Signal(shadow.tau_ff.time_s, fed),
    )
    raising = judged(both)
    assert raising.flown is Mode.SHADOW
    assert raising.go
    assert "yaw" in raising.sentence  # its runs came after


def test_feed_forward_alone_is_judged_by_the_papers_errors():
    dive = flown(Mode.ALONE)
    assert dive.velocity is not None
    exact = {criterion.quantity: criterion.passed for criterion in judged(_on_course(dive, 1.0)).criteria}
    assert exact["surge held speed"] is True
    slow = judged(_on_course(dive, 0.85))
    assert "surge held speed" in failed(slow)
    assert slow.sentence.startswith("NO-GO, lower the feed-forward to shadow: ")
    assert "off by 15.0 % of the speed held, at most 13.4 %" in {
        criterion.words for criterion in slow.criteria
    }


def test_feed_forward_alone_on_a_reference_that_jumps_is_judged_by_the_speeds_that_it_holds():
    dive = flown(Mode.ALONE)
    reference = dive.nu_ref.value.copy()
    for dof, (_, _, top) in TRUTH.items():
        reference[:, dof] = top * np.sign(reference[:, dof]) * (np.abs(reference[:, dof]) > 0.5 * top)
        reference[:, 6 + dof] = 0.0
    jumping = replace(dive, nu_ref=Signal(dive.nu_ref.time_s, reference))
    raising = judged(_on_course(jumping, 1.0))
    passed = {criterion.quantity: criterion.passed for criterion in raising.criteria}
    assert passed["surge held speed"] is True
    assert "surge speeding up" not in passed
    assert raising.go


def _on_course(dive, share):
    """Going at a share of what the reference asks for, without delay."""
    time_s, wanted = dive.nu_ref.time_s, share * dive.nu_ref.value[:, :6]
    return replace(dive, velocity=Signal(time_s, wanted[:, :3]), gyro=Signal(time_s, wanted[:, 3:]))


@pytest.mark.parametrize(("share", "go"), [(0.4, True), (0.6, False)])
def test_with_both_the_pid_must_have_little_left_to_do(share, go):
    dive = flown(Mode.BOTH)
    raising = judged(under(dive, share * dive.tau_ff.value, with_fed=True))
    assert raising.go is go
    assert raising.to is Mode.BOTH
    assert ("may stay at both" in raising.sentence) is go


def test_what_a_dive_does_not_show_is_neither_go_nor_no_go():
    rng = np.random.default_rng(1)
    dive = flown(Mode.SHADOW)
    # Slow noise of the size of the yaw's inertial moment, which hardly matters beside its damping.
    rough = np.convolve(rng.standard_normal(len(dive.tau_pid)), np.ones(40) / 40**0.5, "same")
    pid = dive.tau_pid.value.copy()
    pid[:, 5] += 1.0 * rough
    raising = judged(under(dive, pid))
    passed = {criterion.quantity: criterion.passed for criterion in raising.criteria}
    assert passed["yaw mass"] is None
    assert passed["surge mass"] is True
    assert raising.go


def test_it_is_told_as_plain_data():
    raising = Raising(Mode.SHADOW, Mode.BOTH, (Criterion("surge mass", False, "twice", "identify anew"),))
    assert raising.to_json() == {
        "go": False,
        "from": "shadow",
        "to": "both",
        "sentence": "NO-GO, don't raise it: surge mass. Identify anew.",
        "criteria": [{"what": "surge mass", "passed": False, "words": "twice"}],
    }


def in_modes(*parts):
    """A dive of three axes, each moving for 45 s from 10, 65 and 120 s on, in modes up to the time beside each."""
    dive = flown(Mode.BOTH)
    time_s = np.arange(0.0, 180.0, 1.0)
    mode = np.full(len(time_s), float(parts[-1][0]))
    for part_mode, until_s in reversed(parts):
        mode[time_s < until_s] = float(part_mode)
    at_s = dive.tau_ff.time_s
    acts = mode[np.minimum(at_s.astype(int), len(mode) - 1)] == float(Mode.BOTH)
    commanded = Signal(at_s, dive.tau_pid.value + acts[:, None] * dive.tau_ff.value)
    return replace(dive, ff_mode=Signal(time_s, mode[:, None]), tau_cmd=commanded)


def test_the_part_in_which_the_reference_moves_for_longest_is_judged_and_told():
    dive = in_modes((Mode.OFF, 62.0), (Mode.SHADOW, 180.0))
    part = in_one_mode(dive)
    assert part.mode is Mode.SHADOW
    assert part.dive.nu_ref.time_s[0] == pytest.approx(62.0, abs=1 / RATE_HZ)
    assert part.changed.passed
    assert part.changed.words == (
        "changed in the dive (off 62 s, shadow 117 s); judged is the part in shadow of 117 s"
    )
    assert "mode" not in failed(judged(dive))


def test_a_mode_that_is_no_number_is_not_heard():
    dive = flown(Mode.SHADOW)
    value = dive.ff_mode.value.copy()
    value[700] = np.nan
    part = in_one_mode(replace(dive, ff_mode=Signal(dive.ff_mode.time_s, value)))
    assert (part.mode, part.changed) == (Mode.SHADOW, None)
    nothing = Signal(dive.ff_mode.time_s, np.full_like(value, np.nan))
    assert in_one_mode(replace(dive, ff_mode=nothing)).mode is None


def test_a_feed_forward_that_speeds_up_at_once_and_then_holds_is_judged_by_the_speed_held():
    """The part of a mission after a change of mode: its delay does not show, and is not taken out as anything."""
    dive = flown(Mode.ALONE, axes=(0,))
    reference = dive.nu_ref.value.copy()
    held = dive.nu_ref.time_s >= 15.0
    reference[held, 0], reference[held, 6] = TRUTH[0][2], 0.0
    followed = Signal(dive.nu_ref.time_s, reference[:, :3])
    fed = np.zeros((len(reference), 6))
    fed[:, 0] = TRUTH[0][0] * reference[:, 6] + TRUTH[0][1] * reference[:, 0]
    ended = replace(
        dive,
        nu_ref=Signal(dive.nu_ref.time_s, reference),
        velocity=followed,
        tau_ff=Signal(dive.nu_ref.time_s, fed),
        tau_cmd=Signal(dive.nu_ref.time_s, fed),
    )
    raising = judged(ended.between(11.0, 60.0))
    assert raising.go
    assert [c.quantity for c in raising.criteria if c.by_motion] == ["surge held speed"]


def test_a_long_wait_in_another_mode_is_not_taken_for_the_dive():
    assert in_one_mode(in_modes((Mode.SHADOW, 66.0), (Mode.OFF, 180.0))).mode is Mode.OFF
    still = in_modes((Mode.OFF, 5.0), (Mode.SHADOW, 65.0), (Mode.OFF, 180.0))
    reference = still.nu_ref.value.copy()
    reference[still.nu_ref.time_s > 65.0] = 0.0
    assert in_one_mode(replace(still, nu_ref=Signal(still.nu_ref.time_s, reference))).mode is Mode.SHADOW


def test_a_feed_forward_that_was_taken_back_while_the_vehicle_moved_is_no_go_and_after_it_none():
    raising = judged(in_modes((Mode.BOTH, 20.0), (Mode.OFF, 180.0)))
    assert failed(raising) == ["mode"]
    assert raising.sentence.startswith("NO-GO, don't raise it: mode. Find out why it was taken back")
    assert raising.criteria[0].words.startswith(
        "taken back while the reference moved: changed in the dive (both 20 s"
    )
    after_the_mission = judged(in_modes((Mode.BOTH, 172.0), (Mode.OFF, 180.0)))
    assert after_the_mission.flown is Mode.BOTH
    assert "mode" not in failed(after_the_mission)


def test_a_reference_that_is_unknown_for_a_moment_leaves_its_top_speed_known():
    dive = flown(Mode.ALONE)
    reference = dive.nu_ref.value.copy()
    reference[5] = np.nan
    unknown = replace(dive, nu_ref=Signal(dive.nu_ref.time_s, reference))
    assert failed(judged(unknown)) == failed(judged(dive))
    assert not any(
        "nan" in str(criterion) for criterion in judged(unknown).criteria if criterion.passed is False
    )


@pytest.mark.parametrize(
    ("file", "error", "why"),
    [
        (
            "bolt",
            ConfigError,
            "the recording says VEH_CFG 1, vehicle 'bolt' has 0 bolt; give the file of the vehicle",
        ),
        (
            "ruvifist:survey",
            FitError,
            "says VEH_CFG 1, configuration 'survey' of vehicle 'ruvifist' is 0.*dived with",
        ),
    ],
)
@pytest.mark.parametrize("mode", [Mode.SHADOW, Mode.BOTH])
def test_a_dive_of_another_vehicle_or_configuration_gets_no_verdict_by_the_limits_of_this_file(
    mode, file, error, why
):
    dive = flown(mode)
    of_hovering = replace(dive, veh_cfg=Signal(dive.nu_ref.time_s, np.ones((len(dive.nu_ref), 1))))
    (run,) = validate([of_hovering], FILE).runs
    assert run.raising is not None
    with pytest.raises(error, match=why):
        validate([of_hovering], load_vehicle(file))


def test_thrusters_that_give_another_wrench_than_was_commanded_get_no_verdict():
    dive = flown(Mode.SHADOW)
    curve = thrust_curve(FILE.vehicle.thrust_curve, FILE.path.parent)
    thrusters = Allocator(FILE.vehicle.configurations["hovering"], curve)
    pulses = np.array([curve.pwm(thrusters.allocate(1.5 * tau)[0]) for tau in dive.tau_cmd.value])
    others = replace(dive, pwm=Signal(dive.tau_cmd.time_s, pulses))
    with pytest.raises(FitError, match="the vehicle file's thrusters are not this vehicle's; give"):
        validate([others], load_vehicle("ruvifist:hovering"))
