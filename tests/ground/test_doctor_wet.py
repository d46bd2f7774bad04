"""The wet doctor names every swap, every reversal, every dead thruster and every wrong mounting."""

import itertools
import math

import numpy as np
import pytest
from soak import rest_in_soak
from wet_dive import turned, wet_check

from bridge.errors import ConfigError, LogError
from bridge.sensors.mounting import mounting_matrix
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.thrusters import allocation_matrix, thrust_curve
from bridge.wire.framing import Encoder, Framer
from bridge.wire.readings import Reading, encode
from gcs_plugin.doctor.checks import Level, worst
from gcs_plugin.doctor.latency import Latency, latencies, latency_findings, wet_findings
from gcs_plugin.doctor.pulse_plan import duration_s, pulses
from gcs_plugin.doctor.response import feature_noise, prior_mass_and_damping
from gcs_plugin.doctor.wet import TURNS, corrected, describe, diagnose, findings
from gcs_plugin.doctor.wet_record import Pulse, Series, WetRecord, find_pulses, record_of

VEHICLES = [("ruvifist", "hovering"), ("ruvifist", "survey"), ("bluerov2_heavy", "heavy")]
EIGHT = range(8)
FILES = {name: load_vehicle(name) for name, _ in VEHICLES}


@pytest.fixture(scope="module")
def right():
    """The record of each vehicle with nothing wrong."""
    return {key: wet_check(FILES[key[0]], key[1]) for key in VEHICLES}


def diagnosis_of(key, record):
    vehicle = FILES[key[0]].vehicle
    curve = thrust_curve(vehicle.thrust_curve, FILES[key[0]].path.parent)
    return diagnose(vehicle, vehicle.configurations[key[1]], curve, record)


def is_identity(turn):
    return np.array_equal(turn, np.eye(len(turn)))


def sentences(key, record):
    result = findings(diagnosis_of(key, record), FILES[key[0]].vehicle)
    return {f.name: f.sentence for f in result if f.level is not Level.OK}


@pytest.mark.parametrize("key", VEHICLES)
def test_a_vehicle_with_nothing_wrong_gets_no_complaint(right, key):
    result = findings(diagnosis_of(key, right[key]), FILES[key[0]].vehicle)
    assert worst(result) is Level.OK
    assert len(result) == 11
    assert min(f.confidence for f in result) > 0.95


ALL_PAIRS = list(itertools.combinations(EIGHT, 2))
EACH_ONCE = [(0, 4), (1, 2), (3, 7), (5, 6)]


@pytest.mark.parametrize("key", rest_in_soak(VEHICLES))
@pytest.mark.parametrize("pairs", rest_in_soak([EACH_ONCE, ALL_PAIRS]), ids=len)
def test_every_pair_of_swapped_thrusters_is_named(key, pairs):
    for a, b in pairs:
        wiring = list(EIGHT)
        wiring[a], wiring[b] = b, a
        wrong = sentences(key, wet_check(FILES[key[0]], key[1], wiring=wiring))
        assert set(wrong) == {f"thruster {a + 1}", f"thruster {b + 1}"}, (a, b, wrong)
        assert f"thruster {a + 1} and thruster {b + 1} are swapped" in wrong[f"thruster {a + 1}"]


@pytest.mark.parametrize("key", rest_in_soak(VEHICLES))
@pytest.mark.parametrize(("sign", "words"), [(-1.0, "pushes backwards"), (0.0, "moved nothing")])
def test_every_reversed_and_every_dead_thruster_is_named(key, sign, words):
    for channel in EIGHT:
        signs = np.ones(8)
        signs[channel] = sign
        wrong = sentences(key, wet_check(FILES[key[0]], key[1], signs=signs))
        assert set(wrong) == {f"thruster {channel + 1}"}, (channel, wrong)
        assert words in wrong[f"thruster {channel + 1}"]


@pytest.mark.parametrize("key", rest_in_soak(VEHICLES))
@pytest.mark.parametrize("sensor", ["dvl", "imu"])
@pytest.mark.parametrize("every", rest_in_soak([3, 1]))
def test_every_turn_and_mirror_of_a_sensor_is_named(right, key, sensor, every):
    for turn in TURNS[1::every]:
        result = diagnosis_of(key, turned(right[key], sensor, turn))
        assert np.array_equal(result.turn[sensor], turn), describe(turn)
        assert all(is_identity(m) for name, m in result.turn.items() if name != sensor)
        assert list(result.thruster_of) == list(EIGHT)
        assert (result.sign > 0).all()
        assert result.confidence[sensor] > 0.8


def test_a_gyro_of_the_wrong_sign_is_named(right):
    key = VEHICLES[0]
    wrong = sentences(key, turned(right[key], "fog", None))
    assert wrong == {"fog": "fibre-optic gyro: its sign is wrong; turn its mounting over"}


@pytest.mark.parametrize("seed", rest_in_soak(range(12), keep=3))
def test_several_faults_at_once_are_told_apart(seed):
    key = VEHICLES[seed % 3]
    rng = np.random.default_rng(seed)
    a, b, c = rng.permutation(8)[:3]
    wiring, signs = list(EIGHT), np.ones(8)
    wiring[a], wiring[b], signs[c] = int(b), int(a), -1.0
    turn = TURNS[int(rng.integers(1, 48))]
    result = diagnosis_of(
        key, turned(wet_check(FILES[key[0]], key[1], wiring=wiring, signs=signs, seed=seed), "dvl", turn)
    )
    assert list(result.thruster_of) == wiring
    assert list(result.sign) == list(signs)
    assert np.array_equal(result.turn["dvl"], turn)
    assert is_identity(result.turn["imu"])


def test_the_advice_mends_the_mounting(right):
    key = VEHICLES[0]
    configured = FILES[key[0]].vehicle.sensors.dvl.mounting
    for turn in TURNS:
        mended = np.array(mounting_matrix(corrected(configured, turn)))
        # What the device says is turn @ true after the configured mounting; the advised one must give the truth.
        device = np.array(mounting_matrix(configured)).T @ turn
        assert np.allclose(mended @ device, np.eye(3), atol=1e-4)
    wrong = sentences(key, turned(right[key], "dvl", np.diag([-1.0, -1.0, 1.0])))
    assert wrong == {
        "dvl": "DVL: x shows -x, y shows -y; set its mounting to rotation_deg [180, 0, -45], signs [1, 1, 1]"
    }


@pytest.mark.parametrize("key", rest_in_soak(VEHICLES))
@pytest.mark.parametrize(
    "late", [{"dvl": 0.12, "imu": 0.01, "fog": 0.03}, {"dvl": 0.25, "imu": 0.08, "fog": 0.0}]
)
def test_the_latency_of_each_sensor_is_found(key, late):
    record = wet_check(FILES[key[0]], key[1], latency_s=late)
    vehicle = FILES[key[0]].vehicle
    curve = thrust_curve(vehicle.thrust_curve, FILES[key[0]].path.parent)
    result = latencies(vehicle, vehicle.configurations[key[1]], curve, record, diagnosis_of(key, record))
    assert [f.sensor for f in result] == ["dvl", "imu", "fog"]
    for latency in result:
        error_s = abs(latency.latency_s - late[latency.sensor])
        assert error_s < 3.5 * latency.std_s
        assert error_s < (0.04 if latency.sensor == "dvl" else 0.01)
    by_name = {f.name: f for f in latency_findings(result)}
    assert "add 0." in by_name["dvl latency"].sentence
    assert by_name["fog latency"].level is Level.OK


def test_a_sensor_that_is_not_aboard_is_not_judged(right):
    key = VEHICLES[0]
    record = right[key]
    result = diagnosis_of(key, WetRecord(record.pwm, {"dvl": record.series["dvl"]}))
    assert set(result.turn) == {"dvl"}
    assert list(result.thruster_of) == list(EIGHT)


@pytest.mark.parametrize("sensor", ["dvl", "imu", "fog"])
def test_no_mounting_is_right_of_a_sensor_that_said_nothing_during_the_pulses(right, sensor):
    key = VEHICLES[0]
    record = right[key]
    of_sensor = {"dvl": ("dvl",), "imu": ("rate", "force"), "fog": ("fog",)}[sensor]
    began_s = find_pulses(record.pwm)[0].start_s
    lost = {name: record.series[name].between(-math.inf, began_s) for name in of_sensor}
    spoilt = WetRecord(record.pwm, record.series | lost)
    result = {f.name: f for f in findings(diagnosis_of(key, spoilt), FILES[key[0]].vehicle)}
    assert result[sensor].level is Level.WARN
    assert "the pulses were too weak to be sure" in result[sensor].sentence


def test_a_record_without_sensors_or_without_pulses_is_refused(right):
    key = VEHICLES[0]
    record = right[key]
    with pytest.raises(LogError, match="no sensor said anything"):
        diagnosis_of(key, WetRecord(record.pwm, {}))
    still = Series(record.pwm.time_s, np.full_like(record.pwm.value, 1500.0))
    with pytest.raises(LogError, match="no pulse of thruster 1, 2, 3, 4, 5, 6, 7, 8"):
        diagnosis_of(key, WetRecord(still, record.series))


def test_pulses_of_two_thrusters_at_once_and_long_runs_are_no_pulses():
    time_s = np.arange(0.0, 20.0, 0.05)
    value = np.full((len(time_s), 3), 1500.0)
    value[40:60, 0] = 1600.0
    value[100:120, :2] = 1600.0
    value[150:330, 2] = 1400.0
    result = find_pulses(Series(time_s, value))
    assert [(p.thruster, p.pwm_us) for p in result] == [(0, 1600.0)]
    assert result[0].start_s == pytest.approx(2.0)
    assert result[0].end_s == pytest.approx(3.0)


@pytest.mark.parametrize("key", VEHICLES)
def test_the_pulses_are_gentle_and_fit_into_a_minute(key):
    file = FILES[key[0]]
    curve = thrust_curve(file.vehicle.thrust_curve, file.path.parent)
    planned = pulses(file.vehicle, key[1], curve)
    shape = file.vehicle.configurations[key[1]]
    assert [p.thruster for p in planned] == list(EIGHT)
    assert duration_s(planned) <= 60.0
    assert all(b.start_s - a.start_s - a.duration_s >= 2.5 for a, b in itertools.pairwise(planned))
    mass, _ = prior_mass_and_damping(shape)
    for pulse in planned:
        speed = np.abs(allocation_matrix(shape)[:, pulse.thruster]) * pulse.thrust_n * pulse.duration_s / mass
        share = (speed / np.array([0.15] * 3 + [0.5] * 3)).max()
        # As hard as is gentle, but at least 1 N and at most a quarter of what the thruster can do.
        most_n = min(0.25 * shape.thruster_limit_n, curve.max_n)
        assert share == pytest.approx(1.0) or pulse.thrust_n == (1.0 if share > 1.0 else most_n)
    with pytest.raises(ConfigError, match="no configuration 'flying'"):
        pulses(file.vehicle, "flying", curve)


def test_a_recorded_check_is_read_from_its_frames(right):
    key = VEHICLES[0]
    frames = frames_of(turned(right[key], "dvl", np.diag([1.0, -1.0, 1.0])))
    results = {f.name: f for f in wet_findings(FILES[key[0]], key[1], frames)}
    assert results["dvl"].level is Level.FAIL
    assert results["dvl"].sentence.startswith("DVL: y shows -y")
    assert results["thruster 1"].level is Level.OK
    assert results["fog latency"].level is Level.OK
    assert record_of(frames, 8).series["fog"].time_s == pytest.approx(
        right[key].series["fog"].time_s, abs=1e-6
    )
    with pytest.raises(LogError, match="no commands of 8 thrusters"):
        record_of(frames[:0], 8)


def test_the_noise_of_a_feature_is_that_of_its_two_means_at_rest_and_none_where_the_rest_is_too_short():
    time_s = np.arange(0.0, 120.0, 0.01)
    fog = Series(time_s, 0.1 * np.random.default_rng(1).standard_normal((len(time_s), 1)))
    record = WetRecord(fog, {"fog": fog})
    # Means over 0.8 s before a pulse and over 0.3 s in it.
    expected = 0.1 * math.sqrt(1 / 80 + 1 / 30)
    assert feature_noise(record, [Pulse(0, 119.0, 120.0, 1600.0)])["fog"] == pytest.approx(
        [expected], rel=0.15
    )
    assert feature_noise(record, [Pulse(0, 1.5, 2.5, 1600.0)])["fog"] == pytest.approx([0.0], abs=0.0)


def frames_of(record):
    felt = record.series
    imu = Series(felt["rate"].time_s, np.hstack([felt["force"].value, felt["rate"].value]))
    sent = {"pwm": record.pwm, "dvl": felt["dvl"], "imu": imu, "fog": felt["fog"]}
    more = {"pwm": [0.0] * 24, "dvl": [0.01], "imu": [math.nan], "fog": []}
    readings = [
        Reading(signal, t, (*v, *more[signal]))
        for signal, series in sent.items()
        for t, v in zip(series.time_s, series.value, strict=True)
    ]
    encoder = Encoder(1, 1)
    stream = b"".join(encoder.frame(*encode(r)) for r in sorted(readings, key=lambda r: r.time_s))
    return Framer().feed(stream)


@pytest.mark.parametrize(
    ("latency_s", "words"),
    [
        (0.12, "DVL: 120 ms late, give or take 8 ms; add 0.120 to its latency_s in the vehicle file"),
        (-0.12, "DVL: 120 ms early, give or take 8 ms; take 0.120 off its latency_s in the vehicle file"),
        (0.0, "DVL: 0 ms late, give or take 8 ms"),
        (-0.0002, "DVL: 0 ms early, give or take 8 ms"),
    ],
)
def test_a_sensor_that_is_early_is_not_said_to_be_less_than_nothing_late(latency_s, words):
    assert [finding.sentence for finding in latency_findings([Latency("dvl", latency_s, 0.004)])] == [words]
