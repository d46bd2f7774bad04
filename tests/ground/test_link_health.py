"""Loss, age and rate as seen on one link."""

from bridge.framing import Frame
from gcs_plugin.link_health import MOST_KINDS, MOST_SOURCES, LinkHealth


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
    assert len(told.sources) == len(told.messages) == MOST_SOURCES
    assert told.left_out == 10_001 - MOST_SOURCES
    assert (told.sources[0].received, told.sources[0].lost) == (2, 2)


def test_made_up_kinds_of_messages_fill_no_memory_and_are_counted():
    health = LinkHealth()
    for kind in range(10_000):
        health.on_frame(Frame(b"", kind, 1, 1, kind % 256, True), 1.0)
    told = health.snapshot(2.0)
    assert len(told.messages) == MOST_KINDS
    assert told.left_out == 10_000 - MOST_KINDS
    assert (told.sources[0].received, told.sources[0].lost) == (10_000, 0)
