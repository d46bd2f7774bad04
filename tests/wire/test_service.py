"""The bridge sends the readings of its devices."""

import math
from collections import Counter

import numpy as np
import pytest
from service_rig import SIX, Rig, acted, fog, imu

from bridge.sensors.kvh1750 import encode_kvh1750
from bridge.sensors.samples import EscSample, FogBlock
from bridge.sensors.wayfinder import encode_packet
from bridge.wire.readings import Reading


def test_once_a_second_it_says_that_it_lives_its_clock_its_mode_and_its_configuration():
    rig = Rig(veh_cfg=1)
    kinds: Counter[str] = Counter()
    for tick in range(1, 61):
        kinds.update(m.get_type() for m in rig.step(tick * 0.05))
        if rig.readings_of("clock"):
            (clock,) = rig.readings_of("clock")
            assert clock.values[0] == pytest.approx(rig.clock.unix_s(), abs=1e-5)
            assert [r.values for r in rig.readings_of("veh_cfg")] == [(1.0,)]
            assert [r.values for r in rig.readings_of("ff_mode")] == [(0.0,)]
    assert kinds["HEARTBEAT"] == kinds["SYSTEM_TIME"] == 4
    assert kinds["NAMED_VALUE_FLOAT"] == 8


@pytest.mark.parametrize(("component", "kind", "autopilot"), [(1, 12, 0), (191, 18, 8)])
def test_it_is_a_submarine_alone_and_a_companion_beside_an_autopilot(component, kind, autopilot):
    rig = Rig(component=component)
    beat = rig.step(0.0)[0]
    assert (beat.get_type(), beat.type, beat.autopilot, beat.base_mode & 128) == (
        "HEARTBEAT",
        kind,
        autopilot,
        0,
    )
    assert (beat.get_srcSystem(), beat.get_srcComponent()) == (1, component)
    rig.bridge.armed = True
    assert rig.step(1.0)[0].base_mode & 128


def test_bytes_of_a_device_become_its_message_in_body_axes(rig):
    vector = bytes.fromhex(
        "aa1001620002055b00aa11570000004c00010000181a0b14023703fa00010000003f000080be0000003e0000000000004040666646"
        "409a993940333343403d0a27400080bb44000000000000c0410000bc410000803e30303132333400001c0fc610"
    )
    rig.bridge.receive("dvl", vector[:40], 0.9)
    rig.bridge.receive("dvl", vector[40:], 1.0)
    rig.step(1.0)
    (dvl,) = rig.readings_of("dvl")
    assert (dvl.time_s, dvl.values[:3]) == (1.0, (0.5, -0.25, 0.125))
    assert rig.bridge.navigation.velocity == (0.5, -0.25, 0.125)


def test_noise_on_every_line_ends_no_driver(rig):
    for slot in ("dvl", "imu", "fog", "esc"):
        for seed in range(20):
            rig.bridge.receive(slot, np.random.default_rng(seed).bytes(500), 0.1 * seed)
    rig.step(2.0)
    rig.bridge.receive("dvl", encode_packet(3, b"\0" * 8), 2.0)
    rig.bridge.receive("fog", encode_kvh1750(np.full(200, 0.25)), 2.1)
    rig.step(2.1)
    assert rig.readings_of("fog")


def test_the_imu_goes_out_at_its_rate_as_means_turned_into_body_axes(rig):
    reports = []
    for i in range(1, 101):
        rig.bridge.accept("imu", [imu(0.01 * i, (0.01 * i, 0.0, 9.81))])
        if i % 5 == 0:
            rig.step(0.01 * i)
            reports += rig.readings_of("imu")
    assert len(reports) == pytest.approx(50, abs=1)
    for reading in reports[1:]:
        # The force along x equals the time: a mean that was dated otherwise would show.
        assert reading.values[0] == pytest.approx(reading.time_s, abs=1e-5)
        assert reading.values[2:6] == pytest.approx((-9.81, 0.1, 0.2, 0.3), abs=1e-6)


def test_attitude_goes_out_at_the_control_rate_level_and_north(rig):
    rig.bridge.accept("imu", [imu(0.01), imu(0.02)])
    rig.step(0.05)
    (attitude,) = rig.readings_of("attitude")
    assert attitude.time_s == 0.02
    assert attitude.values[:4] == pytest.approx((1.0, 0.0, 0.0, 0.0), abs=1e-7)
    rig.step(0.1)
    assert rig.readings_of("attitude") == []


def test_the_gyro_tells_the_mean_since_its_last_message_dated_at_the_middle_of_it(rig):
    reports = []
    # The rate equals the time in ms at the end of each sample, so a mean tells which samples are in it.
    for tick in range(20):
        rates = [float(tick * 50 + i + 1) for i in range(50)]
        rig.bridge.accept("fog", [fog(0.05 * (tick + 1), rates)])
        rig.step(0.05 * (tick + 1))
        reports += rig.readings_of("fog")
    assert len(reports) == pytest.approx(40, abs=1)
    # The first interval begins with the first sample, every other one with the end of the one before.
    for reading in reports[1:]:
        assert reading.values[0] == pytest.approx(1000 * reading.time_s + 0.5, rel=1e-6)
    assert np.diff([r.time_s for r in reports[1:]]) == pytest.approx(0.025, abs=1e-6)


def test_invalid_gyro_samples_are_left_out_of_the_mean(rig):
    block = fog(0.1, [1.0] * 100)
    spoilt = np.arange(100) % 3 == 0
    rig.bridge.accept("fog", [FogBlock(block.time_s, np.where(spoilt, 1e3, 1.0), ~spoilt)])
    rig.step(0.1)
    assert [r.values for r in rig.readings_of("fog")] == [(1.0,)] * 3
    for later_s in (0.1, 0.2):
        rig.bridge.accept("fog", [FogBlock(block.time_s + later_s, block.rate, np.zeros(100, bool))])
        rig.step(0.1 + later_s)
    assert rig.readings_of("fog") == []


def test_a_mean_never_reaches_over_a_gap(rig):
    rig.bridge.accept("fog", [fog(0.01, [5.0] * 10)])
    rig.bridge.accept("fog", [fog(0.25, [1.0] * 30)])
    rig.step(0.3)
    assert [r.values for r in rig.readings_of("fog")] == [(1.0,)]
    rig.bridge.accept(
        "imu", [imu(0.01, (5.0, 0.0, 9.81)), imu(0.02, (5.0, 0.0, 9.81)), imu(0.03, (5.0, 0.0, 9.81))]
    )
    rig.bridge.accept("imu", [imu(0.5), imu(0.52)])
    rig.step(0.52)
    assert [r.values[0] for r in rig.readings_of("imu")][-2:] == [0.0, 0.0]


def test_a_control_tick_goes_out_whole_and_sets_the_configuration(rig):
    rig.step(0.0)
    rig.bridge.publish(acted(1.0))
    rig.step(1.0)
    signals = {r.signal for r in rig.readings}
    assert {"pwm", "tau_pid", "tau_ff", "tau_cmd", "nu_fb", "nu_ref"} <= signals
    assert rig.readings_of("veh_cfg")[0].values == (1.0,)
    assert rig.readings_of("nu_fb")[0] == Reading("nu_fb", 1.0, SIX)


def test_shaft_speeds_take_the_sign_of_the_command_and_silent_ones_are_nan(rig):
    rig.bridge.publish(acted(0.1, (1400.0, 1600.0)))
    rig.bridge.accept("esc", [EscSample(0.1, 0, 900.0, 16.0, 2.0)])
    rig.step(0.1)
    (rpm,) = rig.readings_of("rpm")
    assert (rpm.time_s, rpm.values[0]) == (0.1, -900.0)
    assert math.isnan(rpm.values[1])
    assert rpm.values[2:] == (0.0,) * 56
    rig.bridge.publish(acted(0.2, (1500.0, 1500.0)))
    rig.bridge.accept(
        "esc",
        [EscSample(0.2, 0, 200.0, 16.0, 2.0), EscSample(0.2, 1, 100.0, 15.0, 1.0)],
    )
    rig.step(1.05)
    assert rig.readings_of("rpm")[0].values[:2] == (-200.0, 100.0)
    assert rig.readings_of("battery")[0].values == (15.5, 3.0)
    assert rig.bridge.navigation.voltage_v == 15.5
    rig.step(1.1)
    assert rig.readings_of("rpm") == []
    rig.step(2.5)
    assert math.isnan(rig.bridge.navigation.voltage_v)
