"""Silences of a sender, by arrivals, its clock and its sequence numbers."""

import numpy as np
import pytest

from bridge.wire.silences import Silence, longest, silences


def heard(sent_s, kept=None, arrives=lambda sent_s: sent_s, booted_s=0.0, clock_every=1):
    """Frames sent at these times, numbered as sent; `kept` by their number, `arrives` says when; boot time every so
    many."""
    sent_s = np.asarray(sent_s, float)
    number = np.arange(len(sent_s)) % 256
    boot_s = np.where(np.arange(len(sent_s)) % clock_every == 0, sent_s - booted_s, np.nan)
    keep = np.ones(len(sent_s), bool) if kept is None else np.asarray([kept(at_s) for at_s in sent_s])
    arrival_s = np.array([arrives(at_s) for at_s in sent_s[keep]])
    order = np.argsort(arrival_s, kind="stable")
    return silences(arrival_s[order], boot_s[keep][order], number[keep][order])


def times_of(silent):
    return [(round(item.begins_s, 1), round(item.seconds, 1)) for item in silent]


def ticks(seconds, rate_hz):
    return np.arange(0.0, seconds, 1 / rate_hz)


def but(*stretches):
    return lambda at_s: not any(begins_s < at_s < ends_s for begins_s, ends_s in stretches)


def test_a_minute_that_is_not_heard_of_a_dive_is_a_silence():
    assert times_of(heard(ticks(180, 50), but((60.0, 118.7)), booted_s=-400)) == [(60.0, 58.7)]


@pytest.mark.parametrize("clock_every", [1, 50])
def test_a_silence_longer_than_all_that_was_heard_is_one(clock_every):
    result = heard(ticks(3000, 20), but((20.0, 2981.0)), clock_every=clock_every)
    assert times_of(result) == [(20.0, 2961.0)]


def test_two_silences_are_told_and_the_longest_of_them():
    result = heard(ticks(300, 50), but((50.0, 58.1), (100.0, 120.0)))
    assert times_of(result) == [(50.0, 8.1), (100.0, 20.0)]
    assert times_of([longest(result)]) == [(100.0, 20.0)]
    assert longest(()) is None


def test_five_seconds_are_no_silence():
    assert heard(ticks(60, 50), but((20.0, 24.9))) == ()


@pytest.mark.parametrize("spacing_s", [1.0, 2.0, 6.0, 30.0])
def test_heartbeats_alone_are_no_silence_however_slow(spacing_s):
    assert heard(np.arange(0.0, 40 * spacing_s, spacing_s), clock_every=10**6) == ()


def test_a_slow_heartbeat_that_was_not_heard_now_and_then_is_no_silence():
    assert heard(np.arange(0.0, 600.0, 6.0), but((100.0, 118.0), (300.0, 312.0))) == ()


def test_a_vehicle_that_speaks_at_once_every_ten_seconds_is_silent_by_design():
    bursts = np.concatenate([10.0 * n + np.arange(80) * 1e-3 for n in range(30)])
    assert heard(bursts) == ()


def test_a_dive_after_a_wait_with_slow_heartbeats_has_its_own_silence_alone():
    sent_s = np.concatenate([np.arange(0.0, 120.0, 8.0), 120.0 + ticks(600, 50)])
    assert times_of(heard(sent_s, but((300.0, 358.0)))) == [(300.0, 58.0)]


def test_frames_that_a_link_brings_late_are_no_silence():
    stalled = lambda sent_s: 60.0 + sent_s * 1e-3 if 20.0 < sent_s < 60.0 else sent_s  # noqa: E731
    assert heard(ticks(120, 50), arrives=stalled) == ()


def test_of_a_stalled_link_what_it_did_not_keep_alone_is_unheard():
    stalled = lambda sent_s: 60.0 + sent_s * 1e-3 if 20.0 < sent_s < 60.0 else sent_s  # noqa: E731
    result = heard(ticks(120, 50), but((30.0, 50.0)), arrives=stalled)
    assert [item.seconds for item in result] == [pytest.approx(20.0, abs=0.1)]


def test_a_ground_that_stood_still_has_a_silence_though_its_own_clock_shows_none():
    asleep = lambda sent_s: sent_s if sent_s < 50.0 else sent_s - 40.0  # noqa: E731
    assert times_of(heard(ticks(120, 50), but((50.0, 90.0)), arrives=asleep)) == [(50.0, 40.0)]


def test_one_frame_that_comes_very_late_makes_no_silence():
    late = lambda sent_s: sent_s + 12.0 if sent_s == 30.0 else sent_s  # noqa: E731
    assert heard(ticks(120, 50), arrives=late) == ()


def test_of_a_vehicle_that_was_off_only_its_new_start_can_be_unheard():
    first, again = ticks(60, 50), 100.0 + ticks(60, 50)
    arrival_s = np.concatenate([first, again[600:]])
    boot_s = np.concatenate([first, again[600:] - 100.0])
    number = np.concatenate([np.arange(len(first)), np.arange(len(again))[600:]]) % 256
    assert times_of(silences(arrival_s, boot_s, number)) == [(60.0, 12.0)]


def test_a_vehicle_that_starts_anew_and_is_heard_at_once_leaves_no_silence():
    first = ticks(60, 50)
    arrival_s = np.concatenate([first, 100.0 + first])
    boot_s, number = np.concatenate([first, first]), np.tile(np.arange(len(first)), 2) % 256
    assert silences(arrival_s, boot_s, number) == ()


def test_a_silence_after_which_the_numbers_go_on_by_chance_is_one_still():
    result = heard(ticks(600, 100), but((100.0, 100.0 + 25.6 * 2 + 0.005)))
    assert result == (Silence(pytest.approx(100.0), pytest.approx(51.21, abs=0.011)),)


@pytest.mark.parametrize("count", [0, 1])
def test_hardly_anything_heard_has_no_silence(count):
    assert silences(np.zeros(count), np.zeros(count), np.zeros(count, int)) == ()


def test_two_clocks_under_one_address_are_looked_through_at_once():
    arrival_s = ticks(4000, 50)
    boot_s = arrival_s + np.where(np.arange(len(arrival_s)) % 2, 1000.0, 0.0)
    assert silences(arrival_s, boot_s, np.arange(len(arrival_s)) % 256) == ()


def test_of_very_many_pauses_the_longest_are_told():
    sent_s = np.cumsum(np.concatenate([np.tile([0.01, 6.0], 3000), [50.0], np.full(100_000, 0.02)]))
    number = np.arange(len(sent_s)) * 3 % 256
    assert max(silence.seconds for silence in silences(sent_s, sent_s, number)) == pytest.approx(50.0)
