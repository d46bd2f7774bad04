"""Vectors: the commands are the maker's worked examples; LOCKED and LOST are SYNTHETIC (built from the field
table and decoded by Teledyne's own driver; no capture of a real device was to be had)."""

import math
import struct
from datetime import datetime

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.sensors.wayfinder import (
    EXIT_COMMAND_MODE,
    WayfinderParser,
    encode_command,
    encode_packet,
    encode_wayfinder,
)

LOCKED = bytes.fromhex(
    "aa1001620002055b00aa11570000004c00010000181a0b14023703fa00010000003f000080be0000003e000000000000404066664640"
    "9a993940333343403d0a27400080bb44000000000000c0410000bc410000803e30303132333400001c0fc610"
)
LOST = bytes.fromhex(
    "aa1001620002055b00aa11570000004c00010000181a0b14023703fa00010000c07f0000c07f0000c07f0000c07f000040400000c07f"
    "0000c07f0000c07f0000c07f0080bb44000000000000c0410000bc410000803e3030313233340000c4121915"
)
WHEN = datetime(2026, 11, 20, 2, 55, 3, 250_000)
NAN = math.nan


def samples(data):
    return WayfinderParser().feed(data, 10.0)


def test_the_locked_vector_decodes_to_its_stated_values_at_arrival_less_latency():
    parser = WayfinderParser(latency_s=0.125)
    (sample,) = parser.feed(LOCKED, 10.0)
    assert sample.time_s == 9.875
    assert sample.velocity == (0.5, -0.25, 0.125)
    assert sample.altitude_m == pytest.approx(2.61, rel=1e-6)
    assert math.isnan(sample.sigma)
    assert sample.locked


def test_a_lost_lock_is_nan():
    (sample,) = samples(LOST)
    assert not sample.locked
    assert all(map(math.isnan, (*sample.velocity, sample.altitude_m)))


@pytest.mark.parametrize("missing", [None, 0, 1, 2])
def test_three_beams_lack_the_error_alone_which_is_lock_and_without_one_axis_there_is_none(missing):
    velocity = tuple(NAN if axis == missing else value for axis, value in enumerate((0.5, -0.25, 0.125)))
    packet = encode_wayfinder(velocity, (3.0, 3.1, NAN, 3.05), 2.6, WHEN, error_velocity=NAN)
    (sample,) = samples(packet)
    assert sample.locked is (missing is None)
    assert repr(sample.velocity) == repr(velocity)


def test_the_command_that_starts_pinging_is_the_makers():
    assert encode_command(EXIT_COMMAND_MODE).hex() == "aa10010f000203080010000000e700"


def test_the_encoder_writes_the_vectors_byte_for_byte():
    assert encode_wayfinder((0.5, -0.25, 0.125), (3.0, 3.1, 2.9, 3.05), 2.61, WHEN) == LOCKED
    lost = encode_wayfinder((NAN, NAN, NAN), (3.0, NAN, NAN, NAN), NAN, WHEN, error_velocity=NAN)
    assert lost == LOST


def test_a_false_length_withholds_no_more_than_the_packets_that_it_spans():
    liar = b"\xaa\x10\x01\xff\x0f\x02\x05\xf8\x0f"
    result = samples(liar + LOCKED * 45)
    assert len(result) == 45


def test_a_length_beyond_every_packet_is_passed_over():
    parser = WayfinderParser()
    assert len(parser.feed(b"\xaa\x10\x01\xff\xff" + LOCKED, 0.0)) == 1


def test_a_structure_with_a_bad_checksum_inside_a_good_packet_is_refused():
    structure = bytearray(LOCKED[9:-2])
    structure[21] ^= 1
    parser = WayfinderParser()
    assert parser.feed(encode_packet(5, bytes(structure)), 0.0) == []


@pytest.mark.parametrize(
    "packet",
    [
        *(encode_wayfinder((0.5, 0.0, 0.0), (3.0,) * 4, 2.6, WHEN, coordinates=other) for other in (0, 2, 3)),
        encode_wayfinder((0.5, 0.0, 0.0), (3.0,) * 4, 2.6, WHEN, structure_version=0x20),
        encode_packet(4, struct.pack("<IBB", EXIT_COMMAND_MODE, 1, 0)),
    ],
)
def test_other_coordinates_structures_and_answers_are_never_passed_on_as_xyz(packet):
    parser = WayfinderParser()
    assert parser.feed(packet, 0.0) == []


def test_the_old_structure_without_a_serial_number_is_read():
    (sample,) = samples(encode_wayfinder((0.5, 0.0, 0.0), (3.0,) * 4, 2.6, WHEN, structure_version=0x10))
    assert sample.velocity == (0.5, 0.0, 0.0)


@pytest.mark.parametrize(
    ("velocity", "error"),
    [
        *(((math.inf, 0.0, 0.0), 0.0), ((0.0, -25.0, 0.0), 0.0), ((0.0, 0.0, -math.inf), 0.0)),
        *(((NAN, math.inf, NAN), 0.0), ((0.5, -0.25, 0.125), math.inf), ((0.5, -0.25, 0.125), 25.0)),
        *(((NAN, NAN, NAN), -math.inf), ((NAN, NAN, NAN), 25.0)),
    ],
)
def test_a_velocity_or_an_error_that_no_vehicle_has_gives_no_sample(velocity, error):
    parser = WayfinderParser()
    assert parser.feed(encode_wayfinder(velocity, (3.0,) * 4, 2.6, WHEN, error_velocity=error), 0.0) == []


speeds = st.floats(-19, 19, width=32) | st.just(NAN)
ranges = st.floats(0, 80, width=32) | st.just(NAN)


@settings(max_examples=50)
@given(st.tuples(speeds, speeds, speeds), st.tuples(ranges, ranges, ranges, ranges), ranges)
def test_what_is_encoded_is_what_is_parsed(velocity, beams, altitude_m):
    (sample,) = samples(encode_wayfinder(velocity, beams, altitude_m, WHEN))
    assert repr((sample.velocity, sample.altitude_m)) == repr((velocity, altitude_m))
