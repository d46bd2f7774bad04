"""Vectors: CW and GO are REAL frames, from the tests of two open drivers (the `cw.xsens` unit test;
einride/xsens-go testdata/1, an MTi-G-710, MIT). The short commands are those of the ethz-asl driver."""

import math
import random
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sensor_streams import fed

from bridge.sensors.drivers import make_parser
from bridge.sensors.samples import ImuSample
from bridge.sensors.streams import ClockFit
from bridge.sensors.xsens import (
    ACCELERATION,
    ORIENTATION_VALID,
    PACKET_COUNTER,
    QUATERNION,
    RATE_OF_TURN,
    SAMPLE_TIME_FINE,
    STATUS_BYTE,
    STATUS_WORD,
    TEMPERATURE,
    XsensParser,
    encode_message,
    encode_mtdata2,
    encode_xsens,
    layout_of,
)
from bridge.vehicle.config import Device

CW = bytes.fromhex(
    "FAFF365310200289901060040026C73340200C3D0A5D4ABD28441C411D09AF40100C38B08000B8D728003CC9022880200CBAE54C02BB9A3F83"
    "BAD804038030103F800001B612C001B6C57000B60A4000E0200400000005F4"
)
GO = bytes.fromhex(
    "faff3662102002a9861060040314ed5310100c07440be007e301140d2f1837e020040180000740200cbc8e5466c0e82f10bf9ad29e40100c"
    "b935269fbd949930bc46234680200cbb425c343b1068df3ae1c7e58030103f800001b778c7f03738d82737107feef7"
)
FORCE, RATE, LEVEL = (0.5, -0.25, 9.75), (0.125, -0.5, 0.25), (1.0, 0.0, 0.0, 0.0)
OURS = encode_xsens(7, 1.25, FORCE, RATE, LEVEL)
BASE = [(ACCELERATION, struct.pack(">3f", *FORCE)), (RATE_OF_TURN, struct.pack(">3f", *RATE))]
LONG = encode_mtdata2([(0x5040, bytes(200)), *BASE, (0x7010, bytes(100))])
"""Of extended length."""


def sample_of(frame):
    (sample,) = XsensParser().feed(frame, 10.0)
    return sample


@pytest.mark.parametrize(
    ("frame", "force", "rate"),
    [
        (CW, (0.03378, -0.04108, 9.81486), (-0.0017494, -0.0047073, -0.0016481)),
        (GO, (-0.01737, -7.25574, -1.20955), (-0.0029657, 0.0022035, 0.0017226)),
    ],
)
def test_real_frames_decode_to_the_values_their_drivers_state(frame, force, rate):
    parser = XsensParser(latency_s=0.25)
    (sample,) = parser.feed(frame, 10.0)
    assert sample.specific_force == pytest.approx(force, abs=6e-6)
    assert sample.rate == pytest.approx(rate, abs=6e-8)
    assert sample.time_s == 9.75
    assert (sample.attitude, sample.temperature_c) == (None, None)


def test_headers_and_integers_of_the_real_frames_lie_where_they_should():
    for frame, packet, ticks, status in ((CW, 35216, 2541363, 0x5), (GO, 43398, 51703123, 0x01800007)):
        data = frame[4:-1]
        layout = layout_of(data)
        values = layout.unpack(data)
        read = [values[layout.integers[kind]] for kind in (PACKET_COUNTER, SAMPLE_TIME_FINE, STATUS_WORD)]
        assert read == [packet, ticks, status]


def test_the_suggested_output_set_is_an_ordinary_frame():
    items = [
        (PACKET_COUNTER, struct.pack(">H", 7)),
        (SAMPLE_TIME_FINE, struct.pack(">I", 12500)),
        *BASE,
        (QUATERNION, struct.pack(">4f", *LEVEL)),
        (STATUS_WORD, struct.pack(">I", ORIENTATION_VALID)),
    ]
    assert encode_mtdata2(items) == OURS
    assert sample_of(OURS) == ImuSample(10.0, FORCE, RATE, LEVEL)


def encode_numbers(precision, numbers):
    """By the low two bits of an identifier: f32, FP12.20, FP16.32 (the fraction goes first), f64."""
    if precision == 1:
        return struct.pack(f">{len(numbers)}i", *(round(v * 2**20) for v in numbers))
    if precision == 2:
        scaled = (round(v * 2**32) for v in numbers)
        return b"".join(struct.pack(">Ih", s & 0xFFFFFFFF, s >> 32) for s in scaled)
    return struct.pack(f">{len(numbers)}{'d' if precision else 'f'}", *numbers)


@pytest.mark.parametrize("precision", [0, 1, 2, 3])
def test_every_precision_is_read(precision):
    items = [
        (ACCELERATION | precision, encode_numbers(precision, FORCE)),
        (RATE_OF_TURN | precision, encode_numbers(precision, RATE)),
        (QUATERNION | precision, encode_numbers(precision, LEVEL)),
        (TEMPERATURE | precision, encode_numbers(precision, (18.5,))),
    ]
    assert sample_of(encode_mtdata2(items)) == ImuSample(10.0, FORCE, RATE, LEVEL, 18.5)


@pytest.mark.parametrize(
    ("attitude", "status"),
    [(LEVEL, 0), ((0.0,) * 4, ORIENTATION_VALID), ((math.nan, 0, 0, 0), ORIENTATION_VALID)],
)
def test_an_attitude_that_does_not_hold_is_left_out(attitude, status):
    parser = XsensParser()
    (sample,) = parser.feed(encode_xsens(0, 0.0, FORCE, RATE, attitude, status), 0.0)
    assert (sample.rate, sample.attitude) == (RATE, None)


@pytest.mark.parametrize(("status", "attitude"), [(0b01, None), (0b11, LEVEL)])
def test_an_attitude_that_the_short_status_flags_is_left_out_too(status, attitude):
    quaternion = QUATERNION, struct.pack(">4f", *LEVEL)
    frame = encode_mtdata2([*BASE, quaternion, (STATUS_BYTE, bytes((status,)))])
    assert sample_of(frame).attitude == attitude


@pytest.mark.parametrize("axis", range(8, 14))
def test_a_frame_with_an_axis_beyond_its_range_gives_no_sample(axis):
    """Bits 8 to 10 of the status word are the axes of acceleration, 11 to 13 those of the gyros."""
    clipped = encode_xsens(0, 0.0, FORCE, RATE, LEVEL, ORIENTATION_VALID | 1 << axis)
    assert XsensParser().feed(clipped, 0.0) == []


@pytest.mark.parametrize("axis", range(14, 17))
def test_a_magnetometer_beyond_its_range_takes_no_sample_away(axis):
    assert sample_of(encode_xsens(0, 0.0, FORCE, RATE, LEVEL, ORIENTATION_VALID | 1 << axis)).rate == RATE


@pytest.mark.parametrize("frame_bits", [0x4, 0x8])
def test_an_attitude_in_another_frame_than_enu_is_left_out(frame_bits):
    parser = XsensParser()
    frame = encode_mtdata2([*BASE, (QUATERNION | frame_bits, struct.pack(">4f", *LEVEL))])
    (sample,) = parser.feed(frame, 0.0)
    assert sample.attitude is None


@pytest.mark.parametrize("bad", [math.nan, math.inf, 1e9])
def test_numbers_that_are_none_give_no_sample(bad):
    parser = XsensParser()
    assert parser.feed(encode_xsens(0, 0.0, (bad, 0.0, 9.8), RATE, LEVEL), 0.0) == []
    assert parser.feed(encode_xsens(1, 0.0, FORCE, (0.0, bad, 0.0), LEVEL), 0.0) == []


@pytest.mark.parametrize(
    "message",
    [
        encode_message(0x31),
        encode_message(0x42, b"\x04"),
        encode_mtdata2([(0x3010, bytes(4))]),
        encode_mtdata2([(ACCELERATION, bytes(11))]),
        encode_mtdata2([]),
        encode_message(0x36, b"\x40\x20\x0c\x00"),
    ],
)
def test_what_is_no_measurement_is_passed_over(message):
    assert XsensParser().feed(message + encode_mtdata2(BASE), 10.0) == [sample_of(encode_mtdata2(BASE))]


def test_two_sequences_of_one_length_are_told_apart():
    swapped = encode_mtdata2([BASE[1], BASE[0]])
    parser = XsensParser()
    result = fed(parser, [encode_mtdata2(BASE), swapped, encode_mtdata2(BASE)])
    assert {(s.specific_force, s.rate) for s in result} == {(FORCE, RATE)}


def test_the_device_clock_takes_the_jitter_out_of_arrivals():
    rng = random.Random(2)
    parser = XsensParser(clock=ClockFit(1e-4, tolerance=1e-3))
    start = 2**32 * 1e-4 - 10.0  # the tick counter wraps on the way
    errors = []
    for number in range(4000):
        frame = encode_xsens(number, start + number * 0.01, FORCE, RATE, LEVEL)
        (sample,) = parser.feed(frame, 5.0 + number * 0.01 + rng.uniform(0, 0.004))
        errors.append(sample.time_s - (5.0 + number * 0.01 + 0.002))
    assert max(map(abs, errors[1000:])) < 0.3e-3


@pytest.mark.parametrize("stood_s", [0.15, 0.3, 2.0])
def test_what_waited_while_the_computer_stood_still_is_dated_as_if_it_had_not(stood_s):
    parser = make_parser(Device("mti300"), 0)
    for number in range(3000):
        measured_s = number * 0.01
        arrived_s = 20.0 + stood_s if 20.0 < measured_s < 20.0 + stood_s else measured_s
        (sample,) = parser.feed(encode_xsens(number, measured_s, FORCE, RATE, LEVEL), arrived_s)
        assert sample.time_s == pytest.approx(measured_s, abs=5e-3)


numbers = st.floats(-1000, 1000, width=32)
vectors = st.tuples(numbers, numbers, numbers)


@settings(max_examples=50)
@given(vectors, vectors, st.integers(0, 65535), st.integers(0, 2**32 - 1), st.just(0) | st.integers(1, 63))
def test_what_is_encoded_is_what_is_parsed_whatever_the_status_but_of_clipped_axes(
    force, rate, packet, status, clipped
):
    status = status & ~0x3F00 | clipped << 8 | ORIENTATION_VALID
    samples = XsensParser().feed(encode_xsens(packet, 3.0, force, rate, LEVEL, status), 10.0)
    assert [(sample.specific_force, sample.rate, sample.attitude) for sample in samples] == (
        [] if clipped else [(force, rate, LEVEL)]
    )


def test_the_cache_of_layouts_stays_bounded():
    parser = XsensParser()
    for size in range(200):
        assert len(parser.feed(encode_mtdata2([*BASE, (0x5040, bytes(size))]), 0.0)) == 1
    assert len(parser._layouts) <= 32
