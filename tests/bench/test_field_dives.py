"""Field dives: drawn vehicles, planted effects, stock messages, and how answers are judged."""

import struct
from collections import Counter
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bench.field import section
from bench.field.autopilot import NEUTRAL, VelocityFilter, estimated, pulses, reckoned
from bench.field.dive import STEP_S
from bench.field.draw import NONE, draw, effects_of, missing_wrench, stays_down, strength_of
from bench.field.export import STATION, positions, telemetry_of, tlog_of
from bench.field.planted_effects import PLANTS
from bench.field.regressions import ForecastRow, Regressed, drifts_of, fly
from bench.field.score import delays_s, false_causes, judged, magnitudes, rate_also, rate_named
from bench.field.simulate import Sensors
from bench.field.vehicle import draw_vehicle
from bridge.vehicle.config import GRAVITY_M_S2, Water, load_vehicle
from identify.dive import Dive, Signal
from identify.ingest.open import read_dive
from identify.ingest.rotation import euler_angles

QUIET = Sensors(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 16.0, 0.02, 0.0)
HONEST = VelocityFilter(0.0, 0.0, 0.0, 1.0)
SECONDS = 25.0


@cache
def case(effect=NONE, size=1.0):
    return draw(7, 3, effect, size, SECONDS)


def messages(recording):
    """By type, with the microseconds of the stamp."""
    decoder, at, by_type = dialect.MAVLink(None), 0, {}
    while at < len(recording):
        (stamp,) = struct.unpack_from(">Q", recording, at)
        length = recording[at + 9] + 12
        message = decoder.decode(bytearray(recording[at + 8 : at + 8 + length]))
        by_type.setdefault(message.get_type(), []).append((stamp, message))
        at += 8 + length
    return by_type


def test_the_same_seed_gives_the_same_bytes_and_another_seed_others():
    def made(seed):
        drawn = draw(seed, 2, "tether", 1.0, 8.0)
        return drawn.recording(0), drawn.recording(1), drawn.vehicle.text, str(drawn.truth())

    first, again, other = map(made, (5, 5, 6))
    assert first == again
    assert not {*first} & {*other}
    assert first[0] != first[1]


def test_without_noise_the_messages_hold_the_dive_as_it_was():
    flown = case().flown(0)
    flown = replace(flown, noise=np.zeros_like(flown.noise))
    rng = np.random.default_rng(0)
    by_type = messages(tlog_of(telemetry_of(flown, QUIET, HONEST, case().autopilot, rng), 0.0, rng))
    ticks, nu = flown.ticks, flown.ticks.state[:, 7:13]
    attitude = [m for _, m in by_type["ATTITUDE"]]
    read = np.array(
        [[m.roll, m.pitch, m.yaw, m.rollspeed, m.pitchspeed, m.yawspeed] for m in attitude], np.float32
    )
    assert np.array_equal(
        read, np.column_stack([*euler_angles(ticks.state[:, 3:7]), nu[:, 3:]]).astype(np.float32)
    )
    k = ticks.pwm.shape[1]
    servo = [m for _, m in by_type["SERVO_OUTPUT_RAW"]]
    assert np.array_equal([[getattr(m, f"servo{i + 1}_raw") for i in range(k)] for m in servo], ticks.pwm)
    local = [m for _, m in by_type["LOCAL_POSITION_NED"]]
    assert np.array_equal(
        np.array([[m.vx, m.vy, m.vz] for m in local], np.float32),
        ticks.moving[::20].astype(np.float32),
    )
    assert [m.z for m in local] == pytest.approx(ticks.state[::2, 2], abs=1e-6)
    pascal = Water().density_kg_m3 * GRAVITY_M_S2 * ticks.state[::2, 2]
    assert [m.press_abs for _, m in by_type["SCALED_PRESSURE2"]] == pytest.approx(
        1013.25 + pascal / 100, abs=1e-3
    )
    gyro = np.array([[m.xgyro, m.ygyro, m.zgyro] for _, m in by_type["SCALED_IMU2"]])
    assert np.array_equal(gyro, np.round(1000 * nu[:, 3:]))
    volts = [m.voltages[0] / 1000 for _, m in by_type["BATTERY_STATUS"]]
    assert volts == pytest.approx(ticks.supply[::20, 0], abs=6e-4)


def test_messages_come_as_often_as_a_stock_autopilot_sends_them_and_no_others():
    by_type = messages(case().recording(0))
    rates = {name: round(len(rows) / SECONDS) for name, rows in by_type.items()}
    once = dict.fromkeys(("HEARTBEAT", "SYSTEM_TIME", "BATTERY_STATUS"), 1)
    fast = dict.fromkeys(("ATTITUDE", "SERVO_OUTPUT_RAW", "SCALED_IMU2"), 20)
    assert rates == once | fast | dict.fromkeys(("LOCAL_POSITION_NED", "SCALED_PRESSURE2"), 10)
    stamp, first = by_type["SERVO_OUTPUT_RAW"][0]
    assert first.time_usec == 1_000_000 * 47
    assert 0 <= stamp - 1_760_000_000_000_000 < 10_000


def test_a_ground_station_logs_pulses_twice_a_second_and_the_sticks_that_it_sends():
    drawn = replace(case(), rates=STATION)
    by_type = messages(drawn.recording(0))
    rates = {name: round(len(rows) / SECONDS, 1) for name, rows in by_type.items()}
    slow = dict.fromkeys(("SERVO_OUTPUT_RAW", "SCALED_IMU2", "SCALED_PRESSURE2"), 2.0)
    assert {name: rates[name] for name in slow} == pytest.approx(slow, abs=0.2)
    assert rates["LOCAL_POSITION_NED"] == pytest.approx(3.3, abs=0.2)
    sent = [message for _, message in by_type["MANUAL_CONTROL"]]
    assert {message.get_srcSystem() for message in sent} == {255}
    sticks = np.array([[message.x, message.y, message.z, message.r] for message in sent])
    assert np.abs(sticks).max() == 1000
    # As the autopilot got them: a pilot who turns back moves the stick.
    moved = positions(drawn.flown(0).ticks.asked, drawn.autopilot)[:, 0]
    heard = np.interp(np.arange(len(moved)), np.linspace(0, len(moved) - 1, len(sticks)), sticks[:, 0])
    assert np.corrcoef(heard, moved)[0, 1] > 0.98


@pytest.mark.parametrize("straight", [0, 1], ids=["a mixer of thrusts", "a mixer of pulses"])
def test_what_a_mixer_makes_of_surge_goes_with_the_stick(straight):
    drawn = case()
    autopilot = drawn.autopilot._replace(straight=straight)
    asked = np.zeros((3, 5))
    asked[:, 0] = autopilot.reach[0] * np.array([0.0, 1.0, 4.0])
    stick = positions(asked, autopilot)[:, 0]
    want, places = np.zeros(6), np.zeros(autopilot.matrix.shape[1])
    made = []
    for force in asked[:, 0]:
        want[0] = force
        pulses(want, autopilot, places)
        offset = np.abs(places - NEUTRAL).max()
        made.append(offset if straight else autopilot.thrust_at[NEUTRAL + int(offset)])
    np.testing.assert_allclose(np.array(made) / made[-1], stick / stick[-1], atol=0.02)


def test_three_frames_in_a_thousand_are_lost():
    drawn, rng = case(), np.random.default_rng(1)
    heard = telemetry_of(drawn.flown(0), drawn.sensors, drawn.filter, drawn.autopilot, rng)
    whole = sum(map(len, messages(tlog_of(heard, 0.0, rng)).values()))
    kept = sum(map(len, messages(tlog_of(heard, 0.3, rng)).values()))
    assert kept == pytest.approx(0.7 * whole, rel=0.05)
    assert sum(map(len, messages(drawn.recording(0)).values())) == pytest.approx(0.997 * whole, rel=0.003)


@pytest.mark.parametrize("effect", PLANTS)
def test_an_effect_of_no_size_changes_nothing(effect):
    assert all(
        np.array_equal(a, b)
        for a, b in zip(case().flown(0).ticks, draw(7, 3, effect, 0.0, SECONDS).flown(0).ticks, strict=True)
    )


def test_where_nothing_hides_the_true_model_explains_every_newton():
    assert np.abs(missing_wrench(case().flown(0))).max() < 1e-9


@pytest.mark.parametrize("effect", PLANTS)
def test_an_effect_of_middling_size_pushes(effect):
    drawn = case(effect)
    assert strength_of(drawn.flown(0), drawn.sea.std).of_thrust.max() > 0.01
    assert drawn.truth()["effect"] == [effect]
    assert (
        drawn.truth()["effect_parameters"].keys() == drawn.planted.parameters.keys()
        if drawn.planted
        else False
    )


def test_a_dive_that_ran_away_is_felt_without_end_and_no_pilot_goes_on_with_it():
    flown = case().flown(0)
    state = flown.ticks.state.copy()
    state[-10:] = np.nan
    away = replace(flown, ticks=flown.ticks._replace(state=state))
    assert strength_of(away, case().sea.std).size == np.inf
    assert not stays_down(away)


def test_the_command_delay_is_told_as_it_acts():
    drawn = case("command_delay", 1.0)
    assert drawn.truth()["effect_parameters"] == {"delay": 0.15}
    plain, late = (case(effect).flown(0).ticks.state[:, 7:10] for effect in (NONE, "command_delay"))
    first = [int(np.argmax(np.abs(motion[:, 0] - motion[0, 0]) > 0)) for motion in (plain, late)]
    assert first[0] <= first[1]
    assert not np.array_equal(plain, late)


def test_the_filter_is_late_by_what_it_says_and_smooths():
    steps = np.arange(4000) * STEP_S
    ramp = np.column_stack([steps, 2 * steps, 0 * steps])
    late = estimated(ramp, STEP_S, 20, VelocityFilter(0.1, 0.0, 0.0, 1.0), np.random.default_rng(0))
    assert late[50:, 0] == pytest.approx(ramp[::20, 0][50:] - 0.1, abs=1e-9)
    smooth = estimated(ramp, STEP_S, 20, VelocityFilter(0.1, 0.2, 0.0, 1.0), np.random.default_rng(0))
    assert smooth[50:, 1] == pytest.approx(ramp[::20, 1][50:] - 2 * 0.3, abs=0.01)


def test_the_filter_adds_coloured_noise_and_position_is_reckoned_from_what_it_tells():
    still = np.zeros((200_000, 3))
    seen = estimated(still, STEP_S, 20, VelocityFilter(0.1, 0.2, 0.02, 1.0), np.random.default_rng(0))
    assert seen.std() == pytest.approx(0.02, rel=0.1)
    assert np.corrcoef(seen[:-1, 0], seen[1:, 0])[0, 1] == pytest.approx(np.exp(-0.1), abs=0.02)
    assert np.diff(reckoned(seen, 0.1), axis=0) == pytest.approx(0.05 * (seen[1:] + seen[:-1]))


def test_vehicles_are_small_rovs_whose_file_is_read_back_and_knows_no_drag(tmp_path):
    for number in range(12):
        vehicle = draw_vehicle(np.random.default_rng(number), f"rov-{number}")
        (tmp_path / "vehicle.yaml").write_text(vehicle.text, encoding="utf-8")
        read = load_vehicle(str(tmp_path / "vehicle.yaml")).vehicle.configurations
        assert next(iter(read.values())).thrusters == vehicle.configuration.thrusters
        assert len(vehicle.configuration.thrusters) in (6, 8)
        assert not next(iter(read.values())).model
        assert 8.0 <= vehicle.configuration.dry_mass_kg <= 30.0
        assert (vehicle.mass > vehicle.rigid).all()
        assert vehicle.quadratic[0] * 0.4 > vehicle.linear[0]


def test_a_plan_hides_every_effect_as_often_as_any_other_and_nothing_in_one_of_eight():
    counts = Counter(effects_of(1, 240))
    assert counts.pop(NONE) == 30
    assert set(counts) == set(PLANTS)
    assert max(counts.values()) - min(counts.values()) <= 1
    assert effects_of(1, 240) != effects_of(2, 240)


def test_a_written_dive_is_read_as_any_other_recording(tmp_path):
    drawn = case()
    (tmp_path / "vehicle.yaml").write_text(drawn.vehicle.text, encoding="utf-8")
    (tmp_path / "dive.tlog").write_bytes(drawn.recording(0))
    dive = read_dive(tmp_path / "dive.tlog", None, load_vehicle(str(tmp_path / "vehicle.yaml")))
    assert dive.velocity_is_filtered
    assert dive.tau_cmd is None
    assert dive.nu_fb is None
    assert dive.pwm.value.shape[1] == len(drawn.vehicle.configuration.thrusters)


def cause(name, probability=0.9, also=(), **parameters):
    values = {key: {"value": v, "unit": "1", "low95": None, "high95": None} for key, v in parameters.items()}
    return {"name": name, "also": list(also), "probability": probability, "parameters": values}


def dive(hidden, *named, verdict="explained", size=2.0, **truth):
    sealed = {"name": "000", "effect": [hidden], "effect_parameters": truth, "size_over_sea": size}
    answer = {"verdict": verdict, "effects": list(named)}
    return judged({"truth": sealed, "answer": answer, "refusal": "", "seconds": 9.0, "drifts": {}})


def test_a_cause_is_named_that_is_first_or_accepted_where_the_verdict_explains():
    assert dive("tether", cause("tether")).by_name()
    assert dive("tether", cause("tether", 0.3), verdict="partly").by_name()
    assert dive("tether", cause("waves", 0.9), cause("tether", 0.6)).by_name()
    assert not dive("tether", cause("waves", 0.9), cause("tether", 0.4)).by_name()
    assert not dive("tether", cause("tether"), verdict="unknown").by_name()
    assert not dive("tether", cause("tether"), verdict="no_gap").by_name()


def test_what_is_only_among_those_that_could_not_be_told_apart_is_counted_by_itself():
    cases = [
        dive("tether", cause("waves", 0.9, ("tether",))),
        dive("tether", cause("tether", 0.9, ("waves",))),
    ]
    assert (rate_named(cases).hits, rate_also(cases).hits) == (1, 1)
    assert false_causes(cases) == 0
    assert "counted by half, 75.0 % are named" in " ".join(section.further_figures(cases).split())


def test_dives_that_all_hide_nothing_have_a_page_without_a_share_of_none():
    text = section.page([dive(NONE, verdict="no_gap"), dive(NONE, cause("waves"))], 1)
    assert "nan" not in text
    assert "Of 2 dives that hide nothing 1 came without a false cause" in " ".join(text.split())


def test_an_accepted_cause_that_is_not_there_is_false_whatever_the_verdict():
    assert len(dive(NONE, cause("waves", 0.5), verdict="no_gap").false()) == 1
    assert not dive(NONE, cause("waves", 0.49)).false()
    assert [item.name for item in dive("tether", cause("tether"), cause("waves", 0.7)).false()] == ["waves"]


def test_a_dive_with_two_false_causes_of_one_name_is_one_dive_of_the_table():
    both = [cause("weak_thruster", thruster=number) for number in (1.0, 2.0)]
    table = section.wrong([dive(NONE, *both), dive("tether", both[0])])
    assert table.endswith("\n| `weak_thruster` | 2 | 1 |")


def test_of_a_thruster_the_number_has_to_match_where_it_is_told():
    def weak(number):
        return dive(
            "weak_thruster", cause("weak_thruster", thruster=number, gain=0.7), thruster=2.0, gain=0.6
        )

    assert weak(2.0).by_name()
    assert not weak(3.0).by_name()
    assert len(weak(3.0).false()) == 1


def test_sizes_are_judged_over_the_truth_and_delays_in_seconds():
    late = dive("command_delay", cause("command_delay", delay=0.13), delay=0.1)
    assert magnitudes([late]) == pytest.approx([0.3])
    assert delays_s([late]) == pytest.approx([0.03])
    weak = dive("weak_thruster", cause("weak_thruster", thruster=1.0, gain=0.72), thruster=1.0, gain=0.7)
    assert magnitudes([weak]) == pytest.approx([0.02 / 0.3])
    assert magnitudes([dive("tether", cause("waves", force_amplitude=1.0), stiffness=0.1)]) == []


def test_a_plain_method_begins_a_step_before_the_first_row_as_the_diagnosis_does():
    """A body that its drag alone slows, by a model that knows no drag."""
    file = load_vehicle("ruvifist:survey")
    time_s = np.arange(0.0, 12.0, 0.05)
    level = np.tile([1.0, 0.0, 0.0, 0.0], (len(time_s), 1))
    neutral = np.full((len(time_s), len(file.vehicle.configurations["survey"].thrusters)), 1500.0)
    check = Dive(
        "check", Path("check.tlog"), "0", attitude=Signal(time_s, level), pwm=Signal(time_s, neutral)
    )
    rows_s = 1.0 + 0.1 * np.arange(1, 101)
    measured = np.zeros((100, 6))
    measured[:, 0] = 0.5 * np.exp(-0.2 * (rows_s - 1.0))
    foretold = ForecastRow(rows_s, np.repeat([0, 1], 50), measured, measured, measured)
    none = np.zeros(4)
    still = Regressed(none, none, none, np.zeros((4, 2)), none, 0.0)
    flown = fly(still, check, file, "survey", foretold)
    assert flown[:50, 0] == pytest.approx(0.5, abs=5e-4)
    assert flown[50:, 0] == pytest.approx(measured[49, 0])


def test_drifts_are_taken_at_the_horizons_from_the_measured_velocity():
    time_s = np.tile(0.1 * np.arange(1, 51), 2)
    measured = np.zeros((100, 6))
    way = np.zeros((100, 6))
    way[:, 0] = time_s
    way[:50, 1] = np.nan
    foretold = ForecastRow(time_s, np.repeat([0, 1], 50), measured, way, way)
    after_1, after_5 = drifts_of(foretold, way)
    assert after_1[0] == pytest.approx(1.0)
    assert after_5[0] == pytest.approx(5.0)
    assert after_1[1] is None
