"""Planted dives: drawn forces, the truth in the library's words, and nothing where nothing is planted."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bridge.vehicle.config import load_vehicle
from identify.challenge.case import check_of, dive_of, draw_case
from identify.challenge.equations_of_motion import STATES
from identify.challenge.nearest_parameters import missing_velocity, missing_wrench, nominal_columns
from identify.challenge.novel_effects import NOVEL
from identify.challenge.planted_effects import PLANTS
from identify.challenge.scenario import (
    ACCELERATION,
    ATTITUDE,
    DELAY,
    DEPTH,
    LAG,
    LEAK,
    PLAY,
    PULSE,
    THRUST,
    VELOCITY,
    Planted,
    no_force,
    past_of,
    remembered,
    shape_of,
    signal_of,
)
from identify.challenge.tlog import tlog_of
from identify.effects.library import library
from identify.estimators.table import estimator
from identify.ingest.open import read_dive

SCHEMA = Path(__file__).resolve().parents[1] / "data" / "answers.schema.json"
SEED = 100_011
LIBRARY = library(load_vehicle("ruvifist:hovering").vehicle.configurations["hovering"], 0.05)


@pytest.fixture(scope="module")
def honest():
    return draw_case(SEED, names=[], seconds=150.0)


def test_a_vehicle_that_hides_nothing_moves_by_its_nominal_model_alone(honest):
    for which in (0, 1):
        scenario, simulated = honest.simulated(which)
        assert np.abs(simulated.ticks.nu_dot).max() > 0.1
        assert np.abs(missing_wrench(scenario, simulated)).max() < 1e-9
        assert np.abs(missing_velocity(scenario, simulated)).max() < 1e-12


@pytest.fixture(scope="module")
def recorded(honest, tmp_path_factory):
    """The vehicle file and the dive, written and read back."""
    folder = tmp_path_factory.mktemp("recorded")
    (folder / "vehicle.yaml").write_text(honest.vehicle.text, encoding="utf-8")
    (folder / "dive.tlog").write_bytes(tlog_of(dive_of(honest)))
    file = load_vehicle(str(folder / "vehicle.yaml"))
    return file, read_dive(folder / "dive.tlog", vehicle=file)


def test_a_recording_opens_as_the_dive_that_it_was_made_from(honest, recorded):
    (file, read), made = recorded, dive_of(honest)
    assert file.vehicle == honest.file.vehicle
    assert set(read.signals()) == set(made.signals())
    for name, signal in made.signals().items():
        other = read.signals()[name]
        width = signal.value.shape[1]
        assert len(other) == len(signal), name
        assert np.abs(other.time_s - signal.time_s).max() < 2e-3, name
        assert np.allclose(other.value[:, :width], signal.value, rtol=1e-5, atol=6e-3, equal_nan=True), name


def test_its_masses_are_identified_from_the_recording(honest, recorded):
    file, dive = recorded
    fit = estimator("likelihood")(dive, file, honest.configuration, lambda *_: None)
    by_name = {parameter.name: parameter for parameter in fit.parameters}
    truth = honest.truth()["nominal"]
    for name in ("M_u", "M_v", "M_w", "I_r"):
        value, std = by_name[name].value, by_name[name].std
        assert std < 0.1 * value
        assert abs(value - truth[name]) < 4 * std, name


def test_a_seed_gives_the_same_case_again():
    first, second = (draw_case(SEED + 1, seconds=20.0) for _ in range(2))
    assert first.truth() == second.truth()
    assert dive_of(first).sha256 == dive_of(second).sha256


def test_of_two_effects_each_has_a_size_of_its_own():
    pair = draw_case(SEED + 1, names=["quadratic_drag", "dvl_bias"], size=0.5, seconds=20.0)
    alone = draw_case(SEED + 1, names=["quadratic_drag"], size=0.5, seconds=20.0)
    drag, bias = (effect["size"] for effect in pair.truth()["effects"])
    assert drag == alone.truth()["size"] == alone.truth()["effects"][0]["size"]
    assert 0 < bias != drag


def test_the_check_is_another_mission_with_the_same_effect():
    case = draw_case(SEED + 2, names=["quadratic_drag"], size=0.5, seconds=20.0)
    assert dive_of(case).sha256 != check_of(case).sha256
    assert np.array_equal(case.simulated(0)[0].hull.drag, case.simulated(1)[0].hull.drag)


@pytest.mark.parametrize("name", [*PLANTS, *NOVEL])
def test_every_effect_can_be_planted_and_larger_ones_show_more(name):
    small, large = (draw_case(SEED + 3, names=[name], size=size, seconds=30.0) for size in (0.0, 1.0))
    for case in (small, large):
        assert np.isfinite(case.simulated(0)[1].ticks.state).all()
        json.dumps(case.truth(), allow_nan=False)
    unseen = name in (
        "added_payload",
        "dvl_scale",
        "depth_scale",
        "entrained_water",
        "thrust_gain",
        "wrong_feedback_log",
    )
    if not unseen:
        assert large.truth()["size"] > small.truth()["size"] > 0
    assert np.abs(large.simulated(0)[1].ticks.state[:, 7:13]).max() < 3.0


@pytest.mark.parametrize(
    ("name", "left"), [("entrained_water", 1e-9), ("added_payload", 1e-9), ("dvl_scale", 0.3)]
)
def test_what_a_refit_takes_up_leaves_nothing_but_what_turning_adds_at_the_dvl(name, left):
    assert draw_case(SEED + 4, names=[name], size=1.0, seconds=60.0).truth()["size"] < left


def test_there_is_a_plant_for_every_name_that_an_answer_may_give():
    schema = json.loads(SCHEMA.read_text(encoding="utf-8"))
    names = schema["properties"]["effects"]["items"]["properties"]["name"]["enum"]
    assert set(PLANTS) == set(names)
    parameters = {"depth_scale": ["scale"]} | schema["$defs"]["parameters_of_each_effect"]
    for name in names:
        for size in (0.0, 1.0):
            truth = draw_case(SEED, names=[name], size=size).planted[0].parameters
            assert set(truth) == set(parameters[name]), name
            bounds = {p.name: p for item in LIBRARY if item.name == name for p in item.parameters}
            for key in truth.keys() & bounds.keys():
                assert bounds[key].low < truth[key] < bounds[key].high, (name, key, size)


SPOILS = {
    **dict.fromkeys(("dvl_scale", "dvl_bias", "dvl_delay"), (0, 1, 2)),
    **dict.fromkeys(("dvl_misalignment", "dvl_lever_arm", "imu_gravity_leak", "wrong_feedback_log"), (0, 1)),
    "depth_scale": (2,),
    "gyro_bias": (5,),
}
NEEDS = {"free_surface": "shallow", "bottom_or_wall": "low"}


@pytest.mark.parametrize("name", [*PLANTS, *NOVEL])
def test_an_effect_is_known_or_not_and_says_what_it_spoils_and_where_it_acts(name):
    case, which = draw_case(SEED, names=[name]), np.random.default_rng([SEED, 21, 0])
    (planted,) = case.planted
    assert case.kind == ("novel" if name in NOVEL else "one")
    assert (planted.name, planted.spoils, planted.needs) == (name, SPOILS.get(name, ()), NEEDS.get(name, ""))
    of_one = name in ("weak_thruster", "thruster_misalignment")
    assert planted.number == (1 + which.integers(8) if of_one else 0)


def test_every_gyro_aboard_reads_its_bias_beyond_the_turning():
    case = draw_case(NEAREST_SEED, names=["gyro_bias"], size=1.0, seconds=40.0)
    dive, turned = dive_of(case), case.simulated(0)[1].ticks.state[:, 13]
    rate = (turned[-1] - turned[0]) / (dive.pwm.time_s[-1] - dive.pwm.time_s[0])
    for readings in (dive.gyro.value[:, 2], dive.fog.value[:, 0]):
        assert readings.mean() - rate == pytest.approx(parameters_of(case)["z"], rel=0.1)


def test_a_dvl_off_its_place_reads_in_each_axis_what_the_turning_adds_there():
    """By a controller that takes no reading of it, with the same noise, both dives move alike."""
    case, off = draw_case(NEAREST_SEED, names=[], seconds=40.0), np.array([3.0, -2.0, 1.0])

    def dived(arm):
        def apply(scenario, _):
            scenario.faults = scenario.faults._replace(
                dvl_arm=scenario.faults.dvl_arm + arm, feedback_unlogged=1
            )

        simulated = replace(case, planted=(Planted("dvl_lever_arm", {}, apply, 1.0),)).simulated(0)[1]
        return simulated.dive, simulated.ticks.state[:, 10:13]

    (there, turning), (here, same) = dived(off), dived(np.zeros(3))
    assert np.array_equal(turning, same)
    added = there.velocity.value - here.velocity.value
    rates = [np.interp(there.velocity.time_s, there.pwm.time_s, rate) for rate in turning.T]
    for axis, (after, last) in enumerate(((1, 2), (2, 0), (0, 1))):
        table, read = np.column_stack([rates[after], -rates[last]]), np.isfinite(added[:, axis])
        places, *_ = np.linalg.lstsq(table[read], added[read, axis])
        assert places == pytest.approx([off[last], off[after]], abs=0.05), "xyz"[axis]


def test_an_accelerometer_reads_the_weight_by_the_hull_s_tilt_beside_its_motion():
    simulated = draw_case(NEAREST_SEED, names=[], seconds=40.0).simulated(0)[1]
    dive, ticks = simulated.dive, simulated.ticks
    w, x, y, z = ticks.state[:, 3:7].T
    weight = 9.80665 * np.column_stack([2 * (w * y - x * z), -2 * (w * x + y * z)])
    for axis in (0, 1):
        columns = (weight[:, axis], ticks.nu_dot[:, axis])
        table = np.column_stack([np.interp(dive.specific_force.time_s, dive.pwm.time_s, c) for c in columns])
        shares, *_ = np.linalg.lstsq(table, dive.specific_force.value[:, axis])
        assert shares[0] == pytest.approx(1.0, abs=0.3), "xy"[axis]


def test_a_tilted_accelerometer_is_turned_and_not_stretched():
    case = draw_case(NEAREST_SEED, names=["imu_gravity_leak"], size=1.0, seconds=20.0)
    tilt, angles = case.simulated(0)[0].faults.accelerometer_tilt, parameters_of(case)
    assert tilt @ tilt.T == pytest.approx(np.eye(3), abs=1e-12)
    assert (tilt @ [0.0, 0.0, -1.0])[:2] == pytest.approx([angles["pitch"], -angles["roll"]], rel=1e-3)


def test_all_kinds_are_drawn_of_vehicles_that_settle_within_seconds():
    cases = [draw_case(200_000 + seed) for seed in range(60)]
    assert {case.kind for case in cases} == {"none", "one", "two", "novel"}
    assert len({case.configuration for case in cases}) == 3
    assert all(len({p.name for p in case.planted}) == len(case.planted) for case in cases)
    settles_s = np.array([case.vehicle.mass / case.vehicle.damping for case in cases])
    assert 0.15 < settles_s.min() < settles_s.max() < 5.0


STEP_S = 0.01


def state(u=0.0, depth=0.0, heading=0.0):
    out = np.zeros(STATES)
    out[2], out[3], out[6], out[7] = depth, math.cos(0.5 * heading), math.sin(0.5 * heading), u
    return out


def by(*signal, even=(0, 0), power=(1.0, 1.0)):
    both = np.full(2, -1)
    both[: len(signal)] = signal
    return no_force()._replace(signal=both, even=np.array(even), power=np.array(power))


def shape(force, u, depth=0.0):
    return shape_of(force, state(u, depth), np.zeros(6), np.zeros(6), np.zeros(2))


def course(force, product):
    past = past_of(force, STEP_S)
    return np.array([remembered(force, x, i, STEP_S, past) for i, x in enumerate(product.tolist())])


def test_a_signal_is_what_its_place_says():
    now = state(0.3, 2.5, 0.5)
    rate, thrust, pulse = np.arange(6.0), 10 + np.arange(6.0), 20 + np.arange(3.0)
    seen = [
        signal_of(place, now, rate, thrust, pulse)
        for place in (VELOCITY, ACCELERATION + 5, THRUST + 1, ATTITUDE + 2, DEPTH, PULSE + 2)
    ]
    assert seen == pytest.approx([0.3, 5.0, 11.0, math.sin(0.5), 2.5, 22.0])


def test_factors_are_odd_or_even_powers_of_their_signals_in_typical_sizes_and_multiplied():
    odd, even = by(VELOCITY, power=(2.0, 1.0)), by(VELOCITY, even=(1, 0), power=(2.0, 1.0))
    assert [shape(odd, u) for u in (-0.5, 0.5)] == pytest.approx([-0.25, 0.25])
    assert [shape(even, u) for u in (-0.5, 0.5)] == pytest.approx([0.25, 0.25])
    from_middle = by(DEPTH)._replace(middle=np.array([2.0, 0.0]), scale=np.array([0.5, 1.0]))
    assert shape(from_middle, 0.0, depth=3.0) == pytest.approx(2.0)
    assert shape(by(VELOCITY, DEPTH), 0.5, depth=4.0) == pytest.approx(2.0)
    assert shape(by(), 0.5) == 1.0


STEPS = np.ones(200)
NOISE = np.random.default_rng(1).standard_normal(100)
SWING = np.array([0.4, 1.0, 2.0, 1.5, 1.0, 0.5, -1.0])


@pytest.mark.parametrize(
    ("memory", "product", "seen"),
    [
        ({"memory": LAG, "memory_s": 0.7}, STEPS, 1.0 - np.exp(-STEP_S * np.arange(1, 201) / 0.7)),
        ({"memory": DELAY, "memory_s": 0.25}, NOISE, np.concatenate([np.zeros(25), NOISE[:-25]])),
        ({"memory": LEAK, "memory_s": 5.0}, STEPS, 5.0 * (1.0 - (1.0 - STEP_S / 5.0) ** np.arange(1, 201))),
        ({"memory": PLAY, "play": 0.5}, SWING, [0.0, 0.5, 1.5, 1.5, 1.5, 1.0, -0.5]),
    ],
    ids=["lag", "delay", "leaky integral", "hysteresis"],
)
def test_a_memory_follows_its_product(memory, product, seen):
    assert course(no_force()._replace(**memory), product) == pytest.approx(seen)


def test_a_dive_feels_the_drawn_force_and_nothing_else_that_is_missing():
    case = draw_case(391_001, kind="none", seconds=60.0)

    def apply(scenario, _):
        gone = (scenario.time_s > 30.0).astype(np.float64)
        size = np.array([0.0, 3.0, 0.0, 0.0, 0.0, 0.0])
        scenario.drawn = by(VELOCITY, even=(1, 0))._replace(size=size, when=gone)

    scenario, simulated = replace(case, planted=(Planted("drawn_force", {}, apply, 1.0),)).simulated(0)
    missing, ticks = missing_wrench(scenario, simulated), simulated.ticks
    there = simulated.dive.pwm.time_s > 30.0
    wanted = np.zeros_like(missing)
    wanted[there, 1] = 3.0 * np.abs(ticks.state[there, 7])
    assert np.abs(wanted).max() > 0.5
    scenario, simulated = case.simulated(0)
    rounding = np.abs(missing_wrench(scenario, simulated)).max()
    assert np.abs(missing - wanted).max() < 2.0 * rounding + 1e-9


NEAREST_SEED, SECONDS = 310_900, 90.0


def drawn(*names):
    return draw_case(NEAREST_SEED, names=names, size=0.6, seconds=SECONDS)


def parameters_of(case, k=0):
    parameters: dict[str, float] = case.truth()["effects"][k]["parameters"]
    return parameters


def test_an_offset_of_mass_is_told_in_metres_whether_of_the_body_or_of_the_water():
    case = drawn("cg_offset")
    scenario, _ = case.simulated(0)
    moment = float((scenario.rigid + scenario.added)[1, 5])
    mass = case.vehicle.configuration.dry_mass_kg
    assert parameters_of(case)["x"] == pytest.approx(moment / mass, rel=1e-3)


def test_more_drag_astern_is_told_as_how_many_times_as_much():
    case = drawn("drag_asymmetry")
    assert parameters_of(case)["ratio"] == pytest.approx(case.planted[0].parameters["ratio"], rel=0.01)
    assert parameters_of(case)["ratio"] > 1.1


def test_no_other_square_drag_comes_nearer_to_what_is_planted_beside_a_refit():
    case = drawn("quadratic_drag")
    scenario, simulated = case.simulated(0)
    nu, std = simulated.ticks.state[:, 7:13], scenario.vehicle.disturbance
    columns = (nominal_columns(nu, simulated.ticks.nu_dot) / std[None, :, None]).reshape(-1, 12)
    gap, values = missing_wrench(scenario, simulated), np.array([*parameters_of(case).values()])

    def left(size):
        remainder = ((gap + size * nu * np.abs(nu)) / std).reshape(-1)
        return float(np.sum((remainder - columns @ np.linalg.lstsq(columns, remainder, rcond=None)[0]) ** 2))

    nearest = left(values)
    for factor in (0.97, 1.03):
        for dof in (0, 1, 2, 5):
            other = values.copy()
            other[dof] *= factor
            assert left(other) > nearest


def test_of_several_forms_the_nearest_tells_and_names_its_thruster():
    case = drawn("weak_thruster")
    assert parameters_of(case)["thruster"] == case.planted[0].number
    assert parameters_of(case)["gain"] == pytest.approx(case.planted[0].parameters["gain"], abs=0.03)


def test_wrong_readings_are_told_as_they_are_planted_and_beside_them_a_force_by_its_own():
    case = drawn("dvl_bias", "net_buoyancy")
    assert parameters_of(case) == case.planted[0].parameters
    assert parameters_of(case, 1)["force"] == pytest.approx(case.planted[1].parameters["force"], rel=0.05)


@pytest.mark.parametrize(
    ("name", "dofs"), [("depth_scale", ["heave"]), ("wrong_feedback_log", ["surge", "sway"])]
)
def test_an_effect_of_readings_alone_is_nowhere_but_where_it_spoils_them(name, dofs):
    """No force is missing: what rounding leaves is no size."""
    assert drawn(name).truth()["dof"] == dofs


def test_a_current_that_comes_and_goes_is_told_by_the_sine_of_its_power():
    case = drawn("varying_current")
    scenario, _ = case.simulated(0)
    water = scenario.moving_water()[:, :2]
    assert parameters_of(case)["amplitude"] == pytest.approx(np.sqrt(2 * water.var(axis=0).sum()))
    assert parameters_of(case)["period"] == case.planted[0].parameters["period"]


def test_waves_are_told_by_the_force_on_the_vehicle_as_it_turns_in_them():
    case = drawn("waves")
    scenario, simulated = case.simulated(0)
    at, state = case.setup.periods.tick, simulated.ticks.state
    water = scenario.moving_water()[::at][: len(state)]
    to_body = Rotation.from_quat(state[:, [4, 5, 6, 3]]).inv()
    speed, rate = to_body.apply(water[:, 6:9]), to_body.apply(water[:, 9:12])
    force = case.vehicle.damping[:3] * speed + case.vehicle.mass[:3] * rate
    below_m = float(np.median(state[:, 2])) - scenario.hull.wave_ref
    square = np.exp(-2.0 * scenario.hull.wave_number * below_m) * 2.0 * np.mean(force**2, axis=0)
    wanted = np.sqrt(max(square[0] + square[1], square[2]))
    assert parameters_of(case)["force_amplitude"] == pytest.approx(wanted, rel=1e-3)
