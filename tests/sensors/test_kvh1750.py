"""Vectors: SYNTHETIC, from the frame that two independent drivers agree on; no capture of a real unit was
to be had."""

import math
import random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sensor_streams import bytewise, largest_buffer, random_chunks, splits
from soak import rest_in_soak

from bridge.sensors.kvh1750 import LSB_RAD_S, Kvh1750Parser, encode_kvh1750

PLUS_10, MINUS_10, ZERO, PLUS_490 = (
    bytes.fromhex(text) for text in ("1000000051ec", "5000003fae14", "900000000000", "d000000fae14")
)
PERIOD = 1e-3


def rates_of(parser, chunks, time_s=0.0):
    blocks = [block for chunk in chunks for block in parser.feed(chunk, time_s)]
    return np.concatenate([block.rate for block in blocks]) if blocks else np.zeros(0)


def sine(count):
    """Rates that are whole numbers of the least significant bit, no two neighbours the same."""
    return whole(0.3 * np.sin(np.arange(count) * 0.005))


def whole(rates):
    """`rates` rounded to what a frame can carry."""
    return np.rint(rates / LSB_RAD_S) * LSB_RAD_S


def test_the_vectors_decode_to_their_stated_rates():
    parser = Kvh1750Parser()
    rates = rates_of(parser, [(PLUS_10 + MINUS_10 + ZERO + PLUS_490) * 3])
    np.testing.assert_allclose(np.degrees(rates[:4]), [10, -10, 0, 490], atol=4.8e-4)


def test_the_encoder_writes_the_vectors_byte_for_byte():
    assert encode_kvh1750(np.radians([10, -10, 0, 490])) == PLUS_10 + MINUS_10 + ZERO + PLUS_490
    assert encode_kvh1750([LSB_RAD_S, -LSB_RAD_S]).hex() == "100000000001" + "5000003fffff"
    assert math.degrees(LSB_RAD_S) == pytest.approx(476.8e-6, abs=0.05e-6)


def test_ten_counter_steps_lock_and_each_frame_waits_for_the_next_to_confirm_it():
    frames = encode_kvh1750(sine(12))
    parser = Kvh1750Parser()
    assert parser.feed(frames[: 10 * 6], 0.0) == []
    np.testing.assert_array_equal(rates_of(parser, [frames[60:66]]), sine(12)[:10])
    np.testing.assert_array_equal(rates_of(parser, [frames[66:]]), sine(12)[10:11])


@pytest.mark.parametrize("offset", range(6))
def test_the_lock_is_found_on_each_of_the_six_phases(offset):
    frames = encode_kvh1750(sine(40))[offset:]
    expected = sine(40)[1:-1] if offset else sine(40)[:-1]
    np.testing.assert_array_equal(rates_of(Kvh1750Parser(), [frames]), expected)


@pytest.mark.parametrize("slope", [0.5e-3, 64 * LSB_RAD_S, 65 * LSB_RAD_S, 3e-3])
def test_a_noiseless_ramp_does_not_lock_on_its_own_data(slope):
    ramp = np.rint(np.arange(200) * slope / LSB_RAD_S) * LSB_RAD_S
    for offset in range(6):
        parser = Kvh1750Parser()
        rates = rates_of(parser, [encode_kvh1750(ramp)[offset:]])
        np.testing.assert_array_equal(rates, ramp[1 if offset else 0 : -1])


def test_a_stream_may_arrive_in_any_pieces():
    data = encode_kvh1750(sine(14))
    expected = sine(14)[:-1]
    for pieces in (*splits(data), tuple(bytewise(data))):
        parser = Kvh1750Parser()
        np.testing.assert_array_equal(rates_of(parser, pieces), expected)


def test_a_whole_chunk_is_one_block_with_times_backwards_from_its_last_byte():
    parser = Kvh1750Parser(latency_s=0.25)
    (block,) = parser.feed(encode_kvh1750(sine(50)), 10.0)
    np.testing.assert_allclose(block.time_s, 9.75 - np.arange(49, 0, -1) * PERIOD, atol=1e-12)
    assert block.rate.shape == block.valid.shape == (49,)
    assert block.valid.all()
    (block,) = parser.feed(encode_kvh1750(sine(50), first_count=50), 10.05)
    np.testing.assert_allclose(block.time_s, 9.8 - np.arange(50, 0, -1) * PERIOD, atol=1e-12)


def test_bytes_of_the_next_frame_at_the_end_of_a_chunk_do_not_shift_the_times():
    byte_s = 10 / 115200
    data = encode_kvh1750(sine(60))
    for left in range(1, 6):
        (block,) = Kvh1750Parser().feed(data[: 50 * 6 + left], 10.0 + PERIOD - (6 - left) * byte_s)
        np.testing.assert_allclose(block.time_s, 10.0 - np.arange(49, 0, -1) * PERIOD, atol=1e-12)


def test_the_true_period_is_learnt_from_arrivals():
    true_period = 1 / 989.0
    parser = Kvh1750Parser(rate_hz=1000.0)
    blocks = []
    for chunk in range(200):
        data = encode_kvh1750(np.zeros(50), first_count=chunk * 50)
        blocks += parser.feed(data, 5.0 + ((chunk + 1) * 50 - 1) * true_period)
    times = np.concatenate([block.time_s for block in blocks])
    truth = 5.0 + np.arange(times.size) * true_period
    assert np.max(np.abs(times - truth)) < 1e-3
    np.testing.assert_allclose(times[2000:], truth[2000:], atol=2e-6)


def test_times_never_run_back_however_the_arrivals_jitter():
    rng = random.Random(4)
    parser = Kvh1750Parser()
    times = []
    for chunk in range(300):
        data = encode_kvh1750(np.zeros(20), first_count=chunk * 20)
        for block in parser.feed(data, chunk * 0.02 + rng.uniform(-0.2, 0.2) * (rng.random() < 0.1)):
            times.append(block.time_s)
    assert np.all(np.diff(np.concatenate(times)) >= 0)


@pytest.mark.parametrize("lost", range(6))
def test_a_lost_byte_is_one_slip_and_no_wrong_rate(lost):
    data = encode_kvh1750(sine(60))
    at = 30 * 6 + lost
    parser = Kvh1750Parser()
    blocks = parser.feed(data[:at] + data[at + 1 :], 0.06)
    (block,) = blocks
    assert set(block.rate[block.valid]) <= set(sine(60))
    assert block.rate.size >= 56
    assert np.all(np.diff(block.time_s) >= 0)
    np.testing.assert_allclose(block.time_s[:28], np.arange(28) * PERIOD, atol=2.1e-3)


@settings(max_examples=60)
@given(
    st.integers(0, 150 * 6 - 1), st.integers(1, 40), st.binary(max_size=30), st.randoms(use_true_random=False)
)
def test_any_cut_and_any_insertion_relocks_and_the_result_does_not_depend_on_the_pieces(at, lost, junk, rng):
    truth = sine(150)
    data = encode_kvh1750(truth)
    data = data[:at] + junk + data[at + lost :]
    whole, pieced = Kvh1750Parser(), Kvh1750Parser()
    rates = rates_of(whole, [data])
    np.testing.assert_array_equal(rates_of(pieced, random_chunks(data, rng)), rates)
    assert np.isin(rates, truth).sum() >= len(rates) - 4
    assert rates.size > 150 - 30 - (lost + len(junk)) // 6


@pytest.mark.parametrize("bit", [0x01, 0x02, 0x04, 0x08, 0x10])
def test_a_frame_called_invalid_or_out_of_order_and_the_one_before_it_are_flagged_and_the_lock_is_kept(bit):
    data = bytearray(encode_kvh1750(sine(30)))
    data[12 * 6] ^= bit
    parser = Kvh1750Parser()
    (block,) = parser.feed(bytes(data), 0.0)
    assert list(np.flatnonzero(~block.valid)) == [11, 12]


def test_a_head_with_the_bit_that_is_always_zero_set_is_a_slip():
    data = bytearray(encode_kvh1750(sine(40)))
    data[12 * 6] |= 0x20
    parser = Kvh1750Parser()
    (block,) = parser.feed(bytes(data), 0.0)
    np.testing.assert_array_equal(block.rate, np.delete(sine(40)[:-1], [11, 12]))


def test_a_rate_beyond_the_rated_range_is_flagged():
    parser = Kvh1750Parser()
    (block,) = parser.feed(encode_kvh1750(np.full(20, math.radians(491))), 0.0)
    assert not block.valid.any()


def flagged(rates):
    """The frames that are marked invalid, checked to be the same however the stream is cut."""
    data = encode_kvh1750(rates)
    results = [
        np.concatenate([block.valid for piece in pieces for block in parser.feed(piece, 0.0)])
        for pieces in ([data], random_chunks(data, random.Random(1)), bytewise(data))
        for parser in (Kvh1750Parser(),)
    ]
    for valid in results[1:]:
        np.testing.assert_array_equal(valid, results[0])
    return list(np.flatnonzero(~results[0]))


def spike(deg_s):
    return 0.17 + np.radians(np.where(np.arange(40) == 20, deg_s, 0.0))


def step(deg_s):
    return np.radians(np.where(np.arange(40) < 20, 0.0, deg_s))


@pytest.mark.parametrize(
    ("rates", "costs"),
    [
        (spike(100), [20, 21]),
        *((spike(deg_s), [20]) for deg_s in (-2.9, -0.11, 0.11, 2.9)),
        *((step(deg_s), []) for deg_s in (0.05, 2.9)),
        *((step(deg_s), [20]) for deg_s in (3.1, 400.0)),
        (np.radians(0.05) * np.arange(40), []),
        (np.radians(2.9) * np.arange(40), [0]),
    ],
)
def test_a_spike_is_flagged_and_a_step_or_ramp_costs_a_frame_only_beyond_what_a_vehicle_can(rates, costs):
    assert flagged(rates) == costs


def test_a_shaft_that_shakes_the_gyro_costs_no_frame():
    turns = np.arange(2000) * 1e-3
    shaken = np.radians(9.5 + 0.5 * np.sin(2 * np.pi * 100 * turns) + 1.5 * np.sin(2 * np.pi * 25 * turns))
    assert set(flagged(shaken)) <= {0}


def damaged(data, faults, rng):
    """`data` with bits flipped, bytes lost and bytes inserted, `faults` in all, anywhere."""
    stream = bytearray(data)
    for _ in range(faults):
        at = rng.randrange(len(stream))
        kind = rng.choice(("flip", "lose", "insert"))
        if kind == "flip":
            stream[at] ^= 1 << rng.randrange(8)
        elif kind == "lose":
            del stream[at]
        else:
            stream.insert(at, rng.randrange(256))
    return bytes(stream)


@pytest.mark.parametrize(
    "truth",
    rest_in_soak(
        [
            whole(0.3 * np.sin(np.arange(2000) * 0.02)),
            whole(np.full(2000, math.radians(9.5))),
            whole(math.radians(9.5) + 9e-5 * np.random.default_rng(7).standard_normal(2000)),
        ]
    ),
    ids=["turning", "steady", "noisy"],
)
def test_five_faults_in_2000_frames_leave_no_valid_rate_more_wrong_than_a_spike_that_cannot_be_seen(truth):
    wrong, largest, fewest = 0, 0.0, 2000
    for seed in range(150):
        rng = random.Random(seed)
        data = damaged(encode_kvh1750(truth), 5, rng)
        parser = Kvh1750Parser()
        blocks = [b for piece in random_chunks(data, rng, 600) for b in parser.feed(piece, 0.0)]
        rate, valid = (np.concatenate([getattr(b, name) for b in blocks]) for name in ("rate", "valid"))
        near = np.arange(rate.size)[:, None] + np.arange(-5, 30)  # faults shift the frames by this at most
        error = np.abs(truth[np.clip(near, 0, 1999)] - rate[:, None]).min(axis=1)[valid]
        wrong += np.count_nonzero(error > LSB_RAD_S / 2)
        largest, fewest = max(largest, error.max()), min(fewest, np.count_nonzero(valid))
    # A third of the faults are flips, and 8 of a frame's 48 bits move the rate by less than a spike: 42 of 750.
    assert wrong <= 60
    assert largest <= math.radians(0.1)
    assert fewest >= 1970


@settings(max_examples=50)
@given(st.lists(st.integers(-(2**21) + 1, 2**21 - 1), min_size=12, max_size=60), st.integers(0, 3))
def test_what_is_encoded_is_what_is_parsed(raw, first):
    rates = np.array(raw) * LSB_RAD_S
    parsed = rates_of(Kvh1750Parser(), [encode_kvh1750(rates, first_count=first)])
    np.testing.assert_array_equal(parsed, rates[:-1])


def test_memory_stays_bounded_in_noise():
    assert largest_buffer(Kvh1750Parser, random.Random(1)) < 72
    assert largest_buffer(Kvh1750Parser, random.Random(1), alphabet=bytes((0x10, 0x50, 0x90, 0xD0, 0))) < 72
