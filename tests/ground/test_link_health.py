"""Loss, age and rate as seen on one link."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.framing import Encoder, Frame, Framer
from gcs_plugin.link_health import MOST_KINDS, LinkHealth
from gcs_plugin.senders import GONE_S, MOST_SENDERS
from gcs_plugin.watch.links import WatchedLink

FIRST_KIND = 1000  # none that anything reads


def heard(sequences, step_s=0.1, known=True):
    health = LinkHealth()
    for index, sequence in enumerate(sequences):
        health.on_frame(Frame(b"", 0, 1, 1, sequence, known), index * step_s)
    return health.snapshot(len(sequences) * step_s)


def test_gaps_in_the_sequence_are_losses():
    source = heard([0, 1, 4, 5, 7]).sources[0]
    assert (source.received, source.lost) == (5, 3)
    assert source.loss == 3 / 8


def test_the_sequence_runs_round():
    assert heard([254, 255, 0, 1]).sources[0].lost == 0


def test_a_late_frame_takes_its_loss_back_and_a_duplicate_counts_nothing():
    source = heard([0, 2, 1, 3, 3]).sources[0]
    assert (source.received, source.lost) == (4, 0)


def test_after_a_long_silence_the_numbers_may_start_anew():
    assert heard([200, 3], step_s=10.0).sources[0].lost == 0


def clocked(count, before_s=0.0, first=0, missing=()):
    """Ten frames a second of one boot, each second's first with the clock; numbers from `first` on."""
    encoder, framer, frames = Encoder(1, 1), Framer(), []
    for k in range(first + count):
        boot_ms = round(1000 * before_s) + 100 * (k - first)
        clock = dialect.MAVLink_system_time_message(0, boot_ms)
        other = dialect.MAVLink_attitude_message(boot_ms, 0, 0, 0, 0, 0, 0)
        (frame,) = framer.feed(encoder.encode(other if (k - first) % 10 else clock))
        if k >= first and k - first not in missing:
            frames.append(frame)
    return frames


def counted(frames):
    health = LinkHealth()
    for k, frame in enumerate(frames):
        health.on_frame(frame, 0.1 * k)
    (source,) = health.snapshot(0.1 * len(frames)).sources
    return source.received, source.lost


@pytest.mark.parametrize("first", [20, 100, 150, 250])
@pytest.mark.parametrize("unheard", [(), (0, 1, 2)])
def test_numbers_that_start_anew_with_the_vehicle_are_no_loss(first, unheard):
    before = clocked(95, before_s=60.0, first=first, missing=(33,))
    after = clocked(60, missing=(*unheard, 45))
    assert counted([*before, *after]) == (94 + 59 - len(unheard), 2)


def test_a_clock_that_comes_late_or_runs_on_takes_no_loss_back():
    frames = clocked(100, before_s=60.0, missing=(33, 34))
    late = frames.pop(38)
    assert late.message_id == dialect.MAVLINK_MSG_ID_SYSTEM_TIME
    frames.insert(50, late)
    assert counted(frames) == (98, 2)


def test_a_frame_of_an_unknown_id_counts_for_nothing():
    assert heard([0, 9], known=False).sources == ()


def test_age_and_rate_of_each_message_are_told():
    health = heard(list(range(50)))
    assert abs(health.messages[0].rate_hz - 10.0) < 1e-6
    assert abs(health.age_s(0) - 0.1) < 1e-6
    assert health.age_s(99) == float("inf")


def test_made_up_addresses_fill_no_memory_and_take_nobodys_place():
    health = LinkHealth()
    health.on_frame(Frame(b"", 0, 1, 1, 0, True), 0.0)
    for made_up in range(10_000):
        health.on_frame(Frame(b"", 0, made_up % 250 + 2, made_up // 250, 0, True), 1.0)
    health.on_frame(Frame(b"", 0, 1, 1, 3, True), 2.0)
    told = health.snapshot(2.0)
    assert len(told.sources) == len(told.messages) == MOST_SENDERS
    assert told.left_out == 10_001 - MOST_SENDERS
    assert (told.sources[0].received, told.sources[0].lost) == (2, 2)


def test_made_up_kinds_of_messages_fill_no_memory_and_are_counted():
    health = LinkHealth()
    for kind in range(10_000):
        health.on_frame(Frame(b"", FIRST_KIND + kind, 1, 1, kind % 256, True), 1.0)
    told = health.snapshot(2.0)
    assert len(told.messages) == MOST_KINDS
    assert told.left_out == 10_000 - MOST_KINDS
    assert (told.sources[0].received, told.sources[0].lost) == (10_000, 0)


def crowd(health, time_s, kinds=1):
    """As many made-up senders as there are places, none of them (1, 1), each of so many kinds of messages."""
    for made_up in range(MOST_SENDERS):
        for kind in range(kinds):
            health.on_frame(
                Frame(b"", FIRST_KIND + kind, made_up % 250 + 2, made_up // 250, kind, True), time_s
            )


def test_whoever_made_up_addresses_before_the_vehicle_spoke_keeps_it_out_only_until_they_fall_silent():
    health = LinkHealth()
    crowd(health, 0.0)
    health.on_frame(Frame(b"", 7, 1, 1, 0, True), GONE_S)
    told = health.snapshot(GONE_S)
    assert (len(told.sources), told.left_out, told.age_s(7)) == (MOST_SENDERS, 1, float("inf"))
    for sequence in range(1, 4):
        health.on_frame(Frame(b"", 7, 1, 1, sequence, True), GONE_S + sequence)
    told = health.snapshot(GONE_S + 4.0)
    ours = told.sources[0]
    assert (ours.system, ours.component, ours.received, ours.lost, ours.age_s) == (1, 1, 3, 0, 1.0)
    assert (len(told.sources), told.left_out, told.age_s(7)) == (MOST_SENDERS, 1, 1.0)


def test_a_sender_who_is_gone_leaves_the_places_of_his_kinds_of_messages_too():
    health = LinkHealth()
    crowd(health, 0.0, MOST_KINDS // MOST_SENDERS)
    for second in range(1, 70):
        health.on_frame(Frame(b"", FIRST_KIND, 2, 0, 0, True), float(second))
    for kind in range(40):
        health.on_frame(Frame(b"", FIRST_KIND + kind, 1, 1, kind, True), 70.0)
    told = health.snapshot(70.0)
    assert [m.message_id for m in told.messages if m.system == 1] == [FIRST_KIND + kind for kind in range(40)]
    assert any((m.system, m.component) == (2, 0) for m in told.messages)
    assert (len(told.messages) <= MOST_KINDS, told.left_out) == (True, 0)
    for kind in range(MOST_KINDS):
        health.on_frame(Frame(b"", FIRST_KIND + kind, 3, 9, kind % 256, True), 71.0)
    told = health.snapshot(71.0)
    assert (len(told.messages), told.left_out) == (MOST_KINDS, 40 + 16)


def test_who_speaks_once_a_second_or_more_often_keeps_his_place_whoever_comes():
    health = LinkHealth()
    for tenth in range(10 * round(2 * GONE_S)):
        health.on_frame(Frame(b"", 0, 1, 1, tenth % 256, True), tenth / 10)
        health.on_frame(Frame(b"", 0, 2 + tenth % 250, tenth // 250, 0, True), tenth / 10)
    (ours,) = [s for s in health.snapshot(2 * GONE_S).sources if s.system == 1]
    assert (ours.received, ours.lost) == (10 * round(2 * GONE_S), 0)


def test_who_lost_his_place_and_has_another_is_told_of_as_one_who_just_came():
    link = WatchedLink("udpin:1")
    for sequence in range(100):
        link.on_frame(Frame(b"", FIRST_KIND, 1, 1, sequence, True), 0.0)
    crowd(link, 1.0)
    back_s = GONE_S + 5.0
    for second in range(round(back_s)):
        link.on_frame(Frame(b"", FIRST_KIND, 2, 0, second, True), float(second))
    link.on_frame(Frame(b"", FIRST_KIND, 9, 250, 0, True), back_s)
    link.on_frame(Frame(b"", FIRST_KIND, 1, 1, 100, True), back_s)
    (ours,) = [row for row in link.rows(back_s + 1.0) if (row.system, row.component) == (1, 1)]
    assert (ours.rate_hz, ours.loss) == (0.0, 0.0)
