"""The law and the mixer, pure: sticks to force and back."""

import numpy as np
import pytest
import yaml

from bridge import exit_codes
from bridge.ardusub.applet import applet
from bridge.ardusub.law import StickLaw, steady_velocity
from bridge.ardusub.mixing import Mixer
from bridge.errors import ConfigError
from bridge.firmware.ardusub import MOTOR_FACTORS
from bridge.onboard import program
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.mode import Mode
from bridge.vehicle.navigation import Navigation
from bridge.vehicle.thrusters import thrust_curve

FILE = load_vehicle("bluerov2")
SHAPE = FILE.vehicle.configurations["standard"]
CURVE = thrust_curve(FILE.vehicle.thrust_curve, FILE.path.parent)
MIXER = Mixer(1, (1.0,) * 6, SHAPE, CURVE)
MANUAL = 19
MODEL = {name: value for name, value in SHAPE.model.items() if name[0] in "MDIXYN"}
PERIOD_S = 0.04


def test_a_steady_velocity_is_where_drag_balances_the_force():
    for force in (-40.0, -0.1, 0.0, 3.0, 100.0):
        speed = steady_velocity(force, 4.03, 18.18)
        assert 4.03 * speed + 18.18 * abs(speed) * speed == pytest.approx(force, abs=1e-9)
    assert steady_velocity(10.0, 5.0, 0.0) == pytest.approx(2.0)
    assert steady_velocity(10.0, 0.0, 0.0) == 0.0
    assert steady_velocity(-10.0, 1e-3, 0.0) == -3.0
    assert steady_velocity(10.0, float("nan"), 1.0) == 0.0


def errors(axes):
    """Largest error in a wrench that went through sticks and back, N and N m, of many draws on these axes."""
    rng, largest = np.random.default_rng(5), []
    for _ in range(500):
        inputs = np.zeros(3)
        inputs[axes] = rng.uniform(-0.3, 0.3, len(axes))
        wrench = MIXER.wrench(inputs)
        largest.append(np.abs(MIXER.wrench(MIXER.inputs(wrench)) - wrench).max())
    return np.array(largest)


@pytest.mark.parametrize("axes", [[0], [1], [2]])
def test_the_sticks_of_a_single_axis_come_back_from_their_wrench(axes):
    assert errors(axes).max() < 0.6


def test_those_of_three_axes_at_once_come_back_nearly():
    """The frame has no say over the fourth combination of its thrusters, and a dead zone gives no small thrust."""
    largest = errors([0, 1, 2])
    assert np.quantile(largest, 0.9) < 1.0
    assert largest.max() < 5.0


def test_each_stick_pushes_its_own_way():
    assert np.all(np.diag([MIXER.wrench(row)[i] for i, row in enumerate(np.eye(3) * 0.5)] * np.eye(3)) > 0)


@pytest.mark.parametrize(("frame", "name"), [(1, "bluerov2"), (1, "ardusub_vectored"), (2, "bluerov2_heavy")])
def test_the_shipped_vehicle_files_push_as_ardusubs_frames_do(frame, name):
    file = load_vehicle(name)
    shape = next(iter(file.vehicle.configurations.values()))
    assert len(MOTOR_FACTORS[frame]) == len(shape.thrusters)
    curve = thrust_curve(file.vehicle.thrust_curve, file.path.parent)
    assert (
        Mixer(frame, (1.0,) * len(shape.thrusters), shape, curve).wrench(np.array([0.3, 0.0, 0.0]))[0] > 1.0
    )


def test_a_reversed_thruster_in_the_file_alone_is_noticed():
    with pytest.raises(ConfigError, match="MOT_n_DIRECTION"):
        Mixer(1, (1.0, 1.0, -1.0, 1.0, 1.0, 1.0), SHAPE, CURVE)


@pytest.mark.parametrize(("frame", "name"), [(1, "bluerov2"), (2, "bluerov2_heavy")])
def test_outputs_beyond_full_thrust_are_cut_off_each_or_scaled_down_together_by_frame(frame, name):
    file = load_vehicle(name)
    shape = next(iter(file.vehicle.configurations.values()))
    curve = thrust_curve(file.vehicle.thrust_curve, file.path.parent)
    mixer = Mixer(frame, (1.0,) * len(shape.thrusters), shape, curve)
    ahead, aside, turn = mixer.wrench(np.array([0.5, 0.5, 0.5]))
    within = mixer.wrench(np.array([1.0, 1.0, 1.0]) / 3)
    if frame == 1:
        assert ahead > 1.1 * within[0], "the three outputs at half thrust keep it"
    else:
        assert (ahead, aside, turn) == pytest.approx(tuple(within))


def test_the_whole_wrench_of_sticks_has_heave_and_what_the_frame_gives_beside_it():
    inputs = np.array([0.2, -0.1, 0.05])
    whole = MIXER.whole_wrench(inputs, 0.3)
    assert whole[[0, 1, 5]] == pytest.approx(MIXER.wrench(inputs))
    assert MIXER.heave_input(whole[2]) == pytest.approx(0.3, abs=1e-6)
    assert whole[3] == pytest.approx(0.0, abs=1e-9)


def law(coefficients=MODEL):
    return StickLaw(FILE.vehicle, "standard", lambda _: coefficients, FILE.path.parent, MIXER)


def fly(made, sticks, mode=Mode.ALONE, doubt="", flight_mode=MANUAL, start_s=1.0, gain=0.5):
    """What was added at each row of sticks."""
    added = []
    for number, row in enumerate(sticks):
        now_s = start_s + PERIOD_S * number
        out, _ = made.step(now_s, np.array(row, float), gain, mode, doubt, flight_mode, Navigation(), ())
        added.append(out.copy())
    return np.array(added)


STEP = [(0, 0, 0)] * 5 + [(600, 0, 0)] * 120


def test_the_addition_of_a_step_ends_where_it_began_at_nothing():
    added = fly(law(), STEP)
    assert np.abs(added[5:60, 0]).max() > 50
    assert np.abs(added[-1]).max() < 5


def test_the_sum_is_bounded_in_size_and_moves_away_from_the_stick_no_faster_than_its_slope():
    sticks = np.random.default_rng(4).integers(-1000, 1001, (400, 3)).astype(float)
    added = fly(law(), sticks)
    total = sticks + added
    assert np.abs(added).max() <= 600.0
    assert np.abs(total).max() <= 1000
    low, high = np.minimum(total[:-1], sticks[1:]), np.maximum(total[:-1], sticks[1:])
    beyond = np.maximum(low - total[1:], total[1:] - high)
    assert beyond.max() <= 2000.0 * PERIOD_S + 1e-9
    assert beyond.max() > 1.0


def test_raised_under_way_it_begins_at_the_pilots_own_stick():
    made = law()
    fly(made, [(600, 0, 0)] * 30, Mode.SHADOW)
    added = fly(made, [(600, 0, 0), (-600, 0, 0), (-600, 0, 0)], Mode.ALONE, start_s=1.0 + 30 * PERIOD_S)
    assert np.abs(added[0]).max() < 20
    assert 0 < np.abs(added[2]).max() <= 600.0


@pytest.mark.parametrize("mode", [Mode.OFF, Mode.SHADOW])
def test_nothing_is_added_where_the_feedforward_does_not_act(mode):
    assert not fly(law(), STEP, mode).any()


@pytest.mark.parametrize(
    "change", [{"doubt": "two programs send sticks"}, {"flight_mode": 16}, {"flight_mode": 4}]
)
def test_nothing_is_added_in_doubt(change):
    assert not fly(law(), STEP, **change).any()


def test_an_axis_without_its_coefficients_gets_nothing():
    assert not fly(law({}), STEP).any()
    without = {name: value for name, value in MODEL.items() if name != "M_u"}
    assert not fly(law(without), STEP)[:, 0].any()


def test_off_takes_everything_back_at_the_next_stick():
    made = law()
    assert np.abs(fly(made, STEP[:20])[-1]).max() > 20
    off = fly(made, [(600, 0, 0)], Mode.OFF, start_s=1.0 + 20 * PERIOD_S)
    assert not off.any()


def test_after_a_pause_of_the_sticks_the_reference_starts_from_rest():
    made = law()
    fly(made, STEP[:20])
    assert not fly(made, [(600, 0, 0)], start_s=9.0).any()


def test_a_velocity_is_held_against_the_reference_of_its_own_time():
    made, flown, forces = law(), [], []
    for number in range(60):
        now_s = 1.0 + PERIOD_S * number
        aged = [(t, nu) for t, nu in flown if t <= now_s - 0.1]
        read_s, nu = aged[-1] if aged else (now_s, (0.0,) * 6)
        navigation = Navigation(nu[:3], read_s, (0.0, 0.0, 0.0), now_s)
        sticks = np.array([600.0 if number >= 10 else 0.0, 0.0, 0.0])
        _, out = made.step(now_s, sticks, 0.5, Mode.BOTH, "", MANUAL, navigation, ())
        flown.append((now_s, out.reference.nu))
        forces.append(out.tau_pid[:2])
    assert flown[-1][1][0] > 0.2
    assert np.abs(forces).max() < 1e-9


def held_by_a_snag(seconds, sticks, speed_m_s=0.0, read=lambda now_s: now_s):
    """What is added ahead in `both`, and the texts, of a vehicle whose velocity stays as it is; a row each 40 ms."""
    made, added = law(), []
    for number in range(round(seconds / PERIOD_S)):
        now_s = 1.0 + PERIOD_S * number
        navigation = Navigation((speed_m_s, 0.0, 0.0), read(now_s), (0.0, 0.0, 0.0), now_s)
        row = np.array([sticks(now_s - 1.0), 0.0, 0.0])
        out, made_of = made.step(now_s, row, 0.5, Mode.BOTH, "", MANUAL, navigation, ())
        added.append((out[0], made_of.tau_pid[0]))
    return np.array(added), made.take_texts()


def test_a_snagged_vehicle_is_left_alone_once_the_stick_is_at_rest():
    added, _ = held_by_a_snag(40.0, lambda since_s: 300.0 if since_s < 20.0 else 0.0)
    assert added[450, 0] > 10
    assert np.abs(added[-1]).max() < 1e-6


def test_the_hold_pushes_with_a_tenth_of_the_reach_at_most():
    added, _ = held_by_a_snag(30.0, lambda _: 250.0)
    assert 3.0 < added[:, 1].max() <= 10.0


def test_a_velocity_far_off_the_reference_is_not_held_and_told_once():
    added, texts = held_by_a_snag(10.0, lambda _: 300.0, speed_m_s=2.0)
    assert not added[:, 1].any()
    assert [text for text in texts if "not held" in text] == [
        "FF surge not held: velocity off by over 0.5 m/s"
    ]


def test_a_silent_dvl_leaves_nothing_of_what_was_held():
    added, _ = held_by_a_snag(12.0, lambda _: 300.0, read=lambda now_s: min(now_s, 8.0))
    assert added[150, 1] > 1.0
    assert not added[-1, 1]


def test_a_velocity_of_the_future_is_not_held():
    added, _ = held_by_a_snag(10.0, lambda _: 300.0, read=lambda _: 1e6)
    assert not added[:, 1].any()


def test_thrusters_that_rest_at_another_pulse_than_ardusubs_are_refused_before_anything_is_opened(
    tmp_path, capsys
):
    path = tmp_path / "rov.yaml"
    raw = yaml.safe_load(load_vehicle("bluerov2").path.read_text())
    raw["thrust_curve"] = {"kind": "quadratic", "max_n": 40.0, "neutral_us": 1450.0}
    path.write_text(yaml.safe_dump(raw))
    words = ["--ardusub", "--vehicle", str(path), "--link", "udpin:127.0.0.1:0", "--seconds", "0.1"]
    assert program.main([*words, "--parameters", str(tmp_path / "p.json")]) == exit_codes.BAD_INPUT
    why = (
        "neutral_us is 1450, and ArduSub holds a thruster at rest by 1500 us alone; set the speed controllers"
    )
    assert why in " ".join(capsys.readouterr().err.split())
    with pytest.raises(ConfigError, match="ArduSub holds a thruster at rest by 1500 us alone"):
        applet(load_vehicle(str(path)), "standard", {"FRAME_CONFIG": 1.0})
