"""Vectors: `FRAME` is SYNTHETIC, from the offsets and the CRC that open drivers state; no capture was to be had."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.errors import ConfigError
from bridge.sensors.kvh1760 import Kvh1760Parser, encode_kvh1760, encode_setup

FRAME = bytes.fromhex("fe81ff55000000000000000038d1b717000000000000000000000000070509e2cce22399")
LONG_FRAME = encode_kvh1760(2e-4, 6, stamp=123456)
ANGLE = float(np.float32(1e-4))


def rates(blocks):
    return [float(rate) for block in blocks for rate in block.rate]


def test_the_vector_decodes_to_its_stated_angle_as_a_rate():
    parser = Kvh1760Parser(rate_hz=1000.0, latency_s=0.25)
    (block,) = parser.feed(FRAME, 10.0)
    assert rates([block]) == [ANGLE * 1000.0]
    assert list(block.time_s) == [9.75]
    assert list(block.valid) == [True]


def test_the_encoder_writes_the_vector_byte_for_byte():
    assert encode_kvh1760(1e-4, 5, temperature_c=25.30) == FRAME


def test_format_b_is_four_bytes_longer_and_has_its_status_after_the_stamp():
    assert len(LONG_FRAME) == len(FRAME) + 4
    assert LONG_FRAME[32:34] == b"\x07\x06"
    assert rates(Kvh1760Parser(rate_hz=1.0).feed(FRAME + LONG_FRAME + FRAME, 0.0)) == [
        ANGLE,
        float(np.float32(2e-4)),
        ANGLE,
    ]


def test_a_header_of_another_format_is_passed_over():
    parser = Kvh1760Parser(rate_hz=1.0)
    assert rates(parser.feed(b"\xfe\x81\xff\x57" + bytes(34) + FRAME, 0.0)) == [ANGLE]


def test_an_invalid_axis_is_flagged():
    parser = Kvh1760Parser()
    (block,) = parser.feed(encode_kvh1760(1e-4, 0, valid=False) + encode_kvh1760(1e-4, 1), 0.0)
    assert list(block.valid) == [False, True]


def test_a_rate_beyond_the_rated_range_is_flagged_and_a_number_that_is_none_is_left_out():
    parser = Kvh1760Parser(rate_hz=1.0)
    frames = [encode_kvh1760(rotation, i) for i, rotation in enumerate((8.56, math.nan, math.inf, 0.0))]
    (block,) = parser.feed(b"".join(frames), 0.0)
    assert list(block.valid) == [False, True]


def test_missing_frames_leave_their_time_free_through_the_wrap():
    parser = Kvh1760Parser(rate_hz=100.0)
    stream = b"".join(encode_kvh1760(0.0, sequence) for sequence in (126, 127, 0, 3, 4))
    (block,) = parser.feed(stream, 10.0)
    np.testing.assert_allclose(block.time_s, [9.94, 9.95, 9.96, 9.99, 10.0])


def test_the_true_period_is_learnt_from_arrivals():
    period = 1 / 998.0
    parser = Kvh1760Parser(rate_hz=1000.0)
    times = []
    for chunk in range(100):
        data = b"".join(encode_kvh1760(0.0, chunk * 50 + i) for i in range(50))
        (block,) = parser.feed(data, 5.0 + (chunk * 50 + 49) * period)
        times.append(block.time_s)
    truth = 5.0 + np.arange(5000) * period
    np.testing.assert_allclose(np.concatenate(times)[1000:], truth[1000:], atol=1e-5)


def test_the_setup_is_lines_between_config_on_and_off():
    assert encode_setup(500) == b"=config,1\n=rotfmt,delta\n=rotunits,RAD\n=dr,500\n=config,0\n"


def test_a_rate_that_the_device_does_not_have_is_refused_with_those_that_it_has():
    with pytest.raises(ConfigError, match="750, 1000"):
        encode_setup(400)


@settings(max_examples=50)
@given(st.floats(-8, 8, width=32), st.integers(0, 127), st.none() | st.integers(0, 2**32 - 1))
def test_what_is_encoded_is_what_is_parsed(rotation, sequence, stamp):
    frame = encode_kvh1760(rotation, sequence, stamp=stamp)
    assert rates(Kvh1760Parser(rate_hz=1.0).feed(frame, 0.0)) == [rotation]
