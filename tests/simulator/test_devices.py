"""Simulated devices, read back by the real parsers."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bridge.sensors.kvh1750 import Kvh1750Parser
from bridge.sensors.kvh1760 import Kvh1760Parser
from bridge.sensors.mounting import to_body
from bridge.sensors.samples import Arrival, DvlSample
from bridge.sensors.waterlink import WaterlinkJsonParser, WaterlinkSerialParser
from bridge.sensors.wayfinder import WayfinderParser
from bridge.sensors.xsens import XsensParser
from bridge.simulator.body import Instruments
from bridge.simulator.devices import (
    SimulatedBar30,
    SimulatedImu,
    Surroundings,
    a50,
    dsp1750,
    dsp1760,
    wayfinder,
)
from bridge.simulator.plant import Stretch, moments, motion_at
from bridge.simulator.truth import QUIET, NoiseLevels
from bridge.vehicle.config import Device, Mounting, Sensors, ThrustCurve, Water, load_vehicle

SENSORS = load_vehicle("ruvifist").vehicle.sensors
WORLD = Surroundings(QUIET, Water(), ThrustCurve(), 1_790_000_000.0)
YAW = math.radians(30)


def cruise(duration_s=1.0, rate=0.0, depth_m=2.0):
    """Steady motion ahead, aside and down at a heading of 30 degrees, and a yaw that speeds up evenly."""
    time_s = np.arange(round(duration_s * 200) + 1) / 200
    state, nu_dot = np.zeros((len(time_s), 13)), np.zeros((len(time_s), 6))
    state[:, 2] = depth_m
    state[:, 3], state[:, 6] = math.cos(YAW / 2), math.sin(YAW / 2)
    state[:, 7:10] = 0.4, -0.2, 0.05
    state[:, 12] = rate + 0.1 * time_s
    nu_dot[:, 5] = 0.1
    return Stretch(time_s, state, nu_dot, np.zeros(8), np.zeros(8))


@pytest.mark.parametrize("rotation", [(180.0, 0.0, 135.0), (0.0, 0.0, 0.0), (10.0, -20.0, 30.0)])
def test_the_dvl_says_in_its_own_axes_what_the_mounting_turns_back_into_the_bodys(rotation):
    device = replace(SENSORS.dvl, mounting=Mounting(rotation, position_m=(0.3, 0.0, 0.1)))
    chunks = wayfinder("dvl", device, WORLD, np.random.default_rng(0)).arrivals(cruise())
    parser = WayfinderParser(latency_s=device.latency_s)
    samples = [to_body(sample, device.mounting) for c in chunks for sample in parser.feed(c.data, c.time_s)]
    assert len(samples) == 10
    for number, sample in enumerate(samples, start=1):
        assert sample.time_s == pytest.approx(0.1 * number)
        turning = 0.1 * sample.time_s
        np.testing.assert_allclose(sample.velocity, [0.4, -0.2 + 0.3 * turning, 0.05], atol=1e-6)
        assert sample.altitude_m == pytest.approx(6.0)


def test_the_dvl_loses_the_bottom_as_often_as_it_is_told_and_says_so():
    world = replace(WORLD, noise=replace(QUIET, dvl_dropout=0.3))
    chunks = wayfinder("dvl", SENSORS.dvl, world, np.random.default_rng(1)).arrivals(cruise(100.0))
    parser = WayfinderParser()
    samples = [sample for c in chunks for sample in parser.feed(c.data, c.time_s)]
    lost = [sample for sample in samples if isinstance(sample, DvlSample) and not sample.locked]
    assert len(lost) / len(samples) == pytest.approx(0.3, abs=0.05)
    assert all(math.isnan(sample.altitude_m) for sample in lost)


def test_the_imu_at_rest_feels_gravity_and_knows_its_heading():
    still = cruise()
    still.state[:, 7:], still.nu_dot[:] = 0.0, 0.0
    chunks = SimulatedImu("imu", SENSORS.imu, WORLD, np.random.default_rng(0)).arrivals(still)
    parser = XsensParser()
    samples = [to_body(s, SENSORS.imu.mounting) for c in chunks for s in parser.feed(c.data, c.time_s)]
    assert len(samples) == 100
    sample = samples[-1]
    np.testing.assert_allclose(sample.specific_force, [0.0, 0.0, -9.80665], atol=1e-5)
    np.testing.assert_allclose(sample.rate, 0.0, atol=1e-7)
    np.testing.assert_allclose(sample.attitude, [math.cos(YAW / 2), 0, 0, math.sin(YAW / 2)], atol=1e-6)
    assert sample.time_s == pytest.approx(1.0)


def test_an_imu_off_the_origin_feels_the_turn():
    device = replace(SENSORS.imu, mounting=Mounting((180.0, 0.0, 0.0), position_m=(0.5, 0.0, 0.0)))
    chunks = SimulatedImu("imu", device, WORLD, np.random.default_rng(0)).arrivals(cruise(rate=0.2))
    sample = to_body(XsensParser().feed(chunks[-1].data, chunks[-1].time_s)[0], device.mounting)
    turning = 0.3
    coriolis = np.array([0.2 * turning, 0.4 * turning, 0.0])
    lever = np.array([-0.5 * turning**2, 0.5 * 0.1, 0.0])
    np.testing.assert_allclose(sample.specific_force, coriolis + lever + [0, 0, -9.80665], atol=1e-5)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_every_frame_of_the_gyro_is_the_mean_rate_over_its_own_millisecond(sign):
    device = replace(SENSORS.fog, mounting=Mounting(signs=(1.0, 1.0, sign)))
    gyro = dsp1750("fog", device, WORLD, np.random.default_rng(0))
    (chunk,) = gyro.arrivals(cruise(rate=-0.05))
    (block,) = Kvh1750Parser().feed(chunk.data, chunk.time_s)
    block = to_body(block, device.mounting)
    assert len(block.rate) == 999
    truth = -0.05 + 0.1 * (np.arange(1, 1000) - 0.5) / 1000
    np.testing.assert_allclose(block.rate, truth, atol=0.6 * math.radians(1000 / 2**21))
    np.testing.assert_allclose(block.time_s, np.arange(1, 1000) / 1000, atol=2e-3)


def test_a_dsp1760_tells_the_same_as_angles_turned():
    device = Device("kvh1760")
    (chunk,) = dsp1760("fog", device, WORLD, np.random.default_rng(0)).arrivals(cruise(rate=-0.05))
    rates = np.concatenate([block.rate for block in Kvh1760Parser().feed(chunk.data, chunk.time_s)])
    np.testing.assert_allclose(rates, -0.05 + 0.1 * (np.arange(1, 1001) - 0.5) / 1000, atol=1e-7)


def test_noise_has_the_deviation_of_the_table():
    world = replace(WORLD, noise=NoiseLevels(dvl_dropout=0.0))
    chunks = wayfinder("dvl", SENSORS.dvl, world, np.random.default_rng(2)).arrivals(cruise(100.0))
    parser = WayfinderParser()
    velocities = np.array([s.velocity for c in chunks for s in parser.feed(c.data, c.time_s)])
    np.testing.assert_allclose(velocities.std(axis=0), 0.004, rtol=0.1)


def test_moments_belong_to_one_stretch_each():
    whole = cruise(2.0)
    halves = [
        Stretch(whole.time_s[a:b], whole.state[a:b], whole.nu_dot[a:b], whole.thrust_n, whole.turned_n)
        for a, b in ((0, 151), (150, 401))
    ]
    for rate_hz in (10.0, 7.0, 100.0, 1000.0):
        apart = np.concatenate([moments(half, rate_hz) for half in halves])
        np.testing.assert_allclose(apart, moments(whole, rate_hz))
        assert len(apart) == 2 * rate_hz


def test_motion_between_two_physics_steps_lies_between_them():
    motion = motion_at(cruise(), np.array([0.0, 0.0025, 1.0]))
    np.testing.assert_allclose(motion.rate[:, 2], [0.0, 0.00025, 0.1])


@pytest.mark.parametrize(
    ("port", "parser"),
    [("tcp:192.168.194.95:16171", WaterlinkJsonParser()), ("/dev/ttyDVL", WaterlinkSerialParser())],
)
def test_an_a50_says_the_velocity_and_how_old_it_is(port, parser):
    device = Device("a50", port, latency_s=0.08)
    chunk = a50("dvl", device, WORLD, np.random.default_rng(0)).arrivals(cruise())[4]
    (sample,) = parser.feed(chunk.data, chunk.time_s)
    assert sample.time_s == pytest.approx(0.5, abs=1e-5)
    np.testing.assert_allclose(sample.velocity, [0.4, -0.2, 0.05], atol=6e-4)
    assert sample.altitude_m == pytest.approx(6.0, abs=0.006)


def test_the_pressure_is_that_of_the_water_above_the_sensor():
    device = Device("bar30", "i2c:1:0x76", mounting=Mounting(position_m=(0.0, 0.0, 0.2)))
    measured = SimulatedBar30("depth", device, WORLD, np.random.default_rng(0)).arrivals(cruise())
    assert [m.time_s for m in measured] == pytest.approx(np.arange(1, 11) / 10)
    for m in measured:
        assert m.sample.pressure_pa == pytest.approx(101325.0 + 998.2 * 9.80665 * 2.2, abs=5.0)
        assert m.sample.temperature_c == pytest.approx(15.0, abs=0.02)


def test_bytes_arrive_in_order_and_not_before_their_latency_has_passed():
    sensors = Sensors(dvl=Device("wayfinder", latency_s=0.07), imu=Device("mti300"), fog=Device("kvh1750"))
    instruments = Instruments(sensors, WORLD, np.random.default_rng(0))
    whole = cruise(0.3)
    arrived: list[Arrival] = []
    for start in range(0, 60, 10):
        rows = slice(start, start + 11)
        part = Stretch(
            whole.time_s[rows], whole.state[rows], whole.nu_dot[rows], whole.thrust_n, whole.turned_n
        )
        now = instruments.arrivals(part)
        assert all(part.time_s[0] < a.time_s <= part.time_s[-1] + 1e-9 for a in now)
        arrived += now
    assert [a.time_s for a in arrived] == sorted(a.time_s for a in arrived)
    assert [round(a.time_s, 3) for a in arrived if a.slot == "dvl"] == [0.17, 0.27]
    assert sum(a.slot == "imu" for a in arrived) == 30


def test_one_more_device_leaves_the_noise_of_the_others_as_it_was():
    world = replace(WORLD, noise=NoiseLevels())

    def gyro_bytes(sensors):
        arrivals = Instruments(sensors, world, np.random.default_rng(5)).arrivals(cruise())
        return [a.data for a in arrivals if a.slot == "fog"]

    alone = Sensors(fog=Device("kvh1750"))
    assert gyro_bytes(alone) == gyro_bytes(replace(alone, imu=Device("mti300"), depth=Device("bar30")))
