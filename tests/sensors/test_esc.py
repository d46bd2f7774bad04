"""Vector: SYNTHETIC, from the table in ArduPilot's AP_BLHeli; no capture was to be had."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sensor_streams import bytewise, fed, flips, largest_buffer, random_chunks, splits

from bridge.sensors.esc import EscParser, encode_esc
from bridge.sensors.samples import EscSample

VECTOR = bytes.fromhex("23064001f4007b00f548")


def four():
    return EscParser(count=4, poles=14)


def answer(number):
    """An answer that shows by its current which controller gave it."""
    return encode_esc(2000.0, 14, 16.0, float(number), 30.0)


def test_the_vector_decodes_to_its_stated_values():
    (sample,) = EscParser(count=1, poles=14, latency_s=0.25).feed(VECTOR, 10.0)
    assert sample == EscSample(9.75, 0, 3500.0, 16.0, 5.0)
    (sample,) = EscParser(count=1, poles=12).feed(VECTOR, 0.0)
    assert sample.rpm == pytest.approx(245 * 200 / 12)


def test_the_encoder_writes_the_vector_byte_for_byte():
    assert encode_esc(3500.0, 14, 16.0, 5.0, 35.0, 123.0) == VECTOR
    assert encode_esc(-3500.0, 14, 16.0, 5.0, 35.0, 123.0) == VECTOR


def test_answers_go_round_the_controllers_in_turn():
    parser = four()
    samples = [s for i in range(10) for s in parser.feed(answer(i % 4), i * 0.005)]
    assert [s.index for s in samples] == [0, 1, 2, 3, 0, 1, 2, 3, 0, 1]
    assert [s.current_a for s in samples] == [s.index for s in samples]


def test_an_answer_may_arrive_in_any_pieces_also_with_pauses_between():
    for gap_s in (0.0, 0.01):
        for pieces in (*splits(VECTOR), tuple(bytewise(VECTOR))):
            parser = four()
            results = [s for i, piece in enumerate(pieces) for s in parser.feed(piece, 1.0 + i * gap_s)]
            assert [s.rpm for s in results] == [3500.0]


@pytest.mark.parametrize("kept", range(10))
def test_an_answer_cut_short_takes_its_turn_and_the_pause_starts_the_next(kept):
    parser = four()
    chunks = [answer(0), answer(1)[:kept], answer(2), answer(3)]
    samples = [s for i, chunk in enumerate(chunks) for s in parser.feed(chunk, i * 0.005)]
    assert [s.current_a for s in samples] == [0.0, 2.0, 3.0]
    turned = 1 if kept >= 3 else 0
    assert [s.index for s in samples] == [0, 1 + turned, 2 + turned]


@pytest.mark.parametrize("pause_s", [0.005, 0.0])
def test_a_broken_answer_takes_its_turn_after_a_pause_and_in_the_middle_of_a_burst(pause_s):
    for bad in flips(answer(1)):
        parser = four()
        samples = [s for i, c in enumerate((answer(0), bad, answer(2))) for s in parser.feed(c, i * pause_s)]
        assert [(s.index, s.current_a) for s in samples] == [(0, 0.0), (2, 2.0)]


def told(silent, late=(), rate_hz=80.0, asked=400):
    """(index, current) of what is told of four controllers, asked at 80 Hz, of which one never answers; some answers
    are read late, with those behind them."""
    parser = EscParser(count=4, poles=14, rate_hz=rate_hz)
    samples, waiting = [], b""
    for k in range(asked):
        waiting += b"" if k % 4 == silent else answer(k % 4)
        if k not in late:
            samples += parser.feed(waiting, 5.0 + k / 80.0 + 0.003 * (k % 3))
            waiting = b""
    return [(sample.index, sample.current_a) for sample in samples]


@pytest.mark.parametrize("silent", [1, 2, 3])
def test_with_the_rate_of_the_requests_a_controller_that_never_answers_keeps_its_number(silent):
    right = told(silent)
    assert len(right) == 300
    assert all(index == current for index, current in right)
    assert not all(index == current for index, current in told(silent, rate_hz=0.0))


def test_answers_that_wait_in_the_port_are_counted_all_the_same():
    whole = told(None, late=range(100, 130))
    assert len(whole) == 400
    assert all(index == current for index, current in whole)
    lacking = told(2, late=range(100, 130))
    assert all(index == current for index, current in lacking)
    assert len(lacking) >= 270


@pytest.mark.parametrize(
    "values", [(0.0, 5.0, 30.0), (81.0, 5.0, 30.0), (16.0, 301.0, 30.0), (16.0, 5.0, 151.0)]
)
def test_what_no_controller_reports_gives_no_sample_and_takes_its_turn(values):
    voltage_v, current_a, temperature_c = values
    parser = four()
    assert parser.feed(encode_esc(0.0, 14, voltage_v, current_a, temperature_c), 0.0) == []
    (sample,) = parser.feed(answer(1), 0.005)
    assert sample.index == 1


def test_a_line_held_low_gives_no_sample():
    parser = four()
    assert parser.feed(bytes(1000), 0.0) == []


@settings(max_examples=50)
@given(st.integers(0, 65535), st.integers(1, 8000), st.integers(0, 30000), st.integers(0, 150))
def test_what_is_encoded_is_what_is_parsed(field, centivolts, centiamps, temperature_c):
    values = field * 200 / 14, centivolts / 100, centiamps / 100
    (sample,) = four().feed(encode_esc(values[0], 14, *values[1:], temperature_c), 0.0)
    assert (sample.rpm, sample.voltage_v, sample.current_a) == values


def test_memory_stays_bounded_in_noise():
    rng = random.Random(1)
    assert largest_buffer(four, rng) < 10
    parser = four()
    for number, chunk in enumerate(random_chunks(rng.randbytes(20_000), rng, 3)):
        parser.feed(chunk, number * 0.01)
        assert len(parser._starts) < 10


def test_good_answers_after_noise_are_found():
    rng = random.Random(4)
    for _ in range(100):
        noise = rng.randbytes(25)
        samples = fed(four(), random_chunks(noise + b"".join(map(answer, range(6))), rng))
        assert [s.current_a for s in samples][-4:] == [2.0, 3.0, 4.0, 5.0]
