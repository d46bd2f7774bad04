"""The framer finds every intact frame, whatever surrounds it and however the stream is split."""

import random

import pytest
from fastcrc.crc16 import mcrf4xx
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.wire import framing
from bridge.wire.framing import ESC_STATUS, Encoder, Framer, decode

BATTERY = [16000] + [65535] * 9


def messages():
    return [
        dialect.MAVLink_heartbeat_message(12, 0, 128, 0, 4, 3),
        dialect.MAVLink_statustext_message(6, b"hello"),
        dialect.MAVLink_debug_float_array_message(7, b"TAU_CMD", 256, [float(i) for i in range(58)]),
        dialect.MAVLink_param_value_message(b"FF_MODE", 2.0, 9, 27, 3),
        dialect.MAVLink_battery_status_message(0, 0, 0, 32767, BATTERY, 20, -1, -1, 90, voltages_ext=[0] * 4),
        dialect.MAVLink_system_time_message(1_790_000_000_000_000, 0xFDFEFDFE),
    ]


def stream(count=60):
    encoder = Encoder(1, 1)
    every = messages()
    return [encoder.encode(every[i % len(every)]) for i in range(count)]


def unknown_frame(payload, sequence=0):
    number = 60_123
    head = bytes((0xFD, len(payload), 0, 0, sequence, 7, 8)) + number.to_bytes(3, "little")
    return head + payload + b"\x12\x34"


def take(chunks):
    framer = Framer()
    frames = [frame.raw for chunk in chunks for frame in framer.feed(chunk)]
    return frames + [frame.raw for frame in framer.flush()]


def test_the_frames_are_the_same_at_every_split_of_the_stream():
    wanted = stream(6)
    data = b"\xfd\xfe" + b"".join(wanted) + unknown_frame(b"\xfd" * 20) + wanted[0] + b"\xfd\x09"
    whole = take([data])
    assert whole == [*wanted, unknown_frame(b"\xfd" * 20), wanted[0]]
    for cut in range(len(data)):
        assert take([data[:cut], data[cut:]]) == whole, cut
    assert take([data[i : i + 1] for i in range(len(data))]) == whole


def test_a_frame_is_read_as_the_message_that_was_packed():
    for message, raw in zip(messages(), stream(6), strict=True):
        (frame,) = Framer().feed(raw)
        assert (frame.system, frame.component, frame.message_id, frame.known) == (
            1,
            1,
            type(message).id,
            True,
        )
        decoded = decode(frame)
        assert decoded.to_dict() == message.to_dict()


def test_the_sequence_counts_frames_of_both_kinds_of_packing_and_wraps():
    encoder = Encoder(1, 1)
    payload = b"\x01" * 9
    data = b"".join(encoder.frame(0, payload) if i % 2 else encoder.encode(messages()[0]) for i in range(300))
    assert [frame.sequence for frame in Framer().feed(data)] == [i % 256 for i in range(300)]


def test_mavlink_1_and_signed_frames_are_read_too():
    link = dialect.MAVLink(None, srcSystem=3, srcComponent=4)
    old = messages()[3].pack(link, force_mavlink1=True)
    link.signing.secret_key, link.signing.sign_outgoing = b"k" * 32, True
    signed = messages()[3].pack(link)
    frames = Framer().feed(old + signed + old)
    assert [frame.raw for frame in frames] == [old, signed, old]
    assert all(frame.known and frame.system == 3 and frame.component == 4 for frame in frames)
    assert all(decode(frame).param_id == "FF_MODE" for frame in frames)
    assert len(frames[0].payload) == 25


def test_a_mavlink_1_frame_that_spells_a_wrong_length_hides_nothing():
    good = stream(1)[0]
    heartbeat_of_200_bytes = bytes((0xFE, 200, 0, 1, 1, 0))
    assert [frame.raw for frame in Framer().feed(heartbeat_of_200_bytes + good)] == [good]


def test_esc_status_is_known_though_pymavlink_has_no_such_message():
    (frame,) = Framer().feed(Encoder(1, 1).frame(ESC_STATUS, bytes(range(57))))
    assert frame.known
    assert decode(frame) is None


def test_every_intact_frame_survives_one_flipped_bit_in_a_thousand_bytes():
    rng = random.Random(4)
    frames = stream(3000)
    damaged = bytearray(b"".join(frames))
    hurt = set()
    starts, at = [], 0
    for frame in frames:
        starts.append(at)
        at += len(frame)
    owner = [i for i, frame in enumerate(frames) for _ in frame]
    for block in range(0, len(damaged), 1000):
        place = min(block + rng.randrange(1000), len(damaged) - 1)
        damaged[place] ^= 1 << rng.randrange(8)
        hurt.add(owner[place])
    results = [f.raw for f in _feed_in_pieces(bytes(damaged), 4096) if f.known]
    assert results == [frame for i, frame in enumerate(frames) if i not in hurt]


def _feed_in_pieces(data, size):
    framer = Framer()
    frames = [frame for i in range(0, len(data), size) for frame in framer.feed(data[i : i + size])]
    return frames + framer.flush()


def test_a_frame_of_an_unknown_id_passes_unchecked_and_in_its_place():
    a, b = stream(2)
    strange = unknown_frame(bytes(40), 5)
    framer = Framer()
    frames = framer.feed(a + strange + b)
    assert [(f.raw, f.known) for f in frames] == [(a, True), (strange, False), (b, True)]
    assert (frames[1].message_id, frames[1].system, frames[1].component, frames[1].sequence) == (
        60_123,
        7,
        8,
        5,
    )
    assert framer.counts == {"good": 2, "unknown": 1}
    assert decode(frames[1]) is None


def test_a_false_start_with_an_unknown_id_never_swallows_good_frames():
    good = stream(12)
    false_start = bytes((0xFD, 255, 0, 0, 0, 1, 1)) + (60_123).to_bytes(3, "little")
    for junk in (false_start, false_start + b"x" * 30, b"\xfd", b"\xfe\xff", good[0][:-1]):
        assert take([junk + b"".join(good)]) == good
        assert take([good[0] + junk + b"".join(good)]) == [good[0], *good]


def test_a_damaged_frame_is_counted_and_named():
    a, b, c = stream(3)
    framer = Framer()
    hurt = b[:-1] + bytes((b[-1] ^ 1,))
    assert [f.raw for f in framer.feed(a + hurt + c)] == [a, c]
    assert framer.counts == {"good": 2, "checksum": 1, "skipped": len(b)}


def test_a_pause_frees_what_a_broken_start_held_back():
    a, b = stream(2)
    broken_length = bytes((a[0], 250)) + a[2:]
    framer = Framer()
    assert framer.hear(broken_length + b, 0.0) == framer.hear(b"", 0.4) == []
    assert [f.raw for f in framer.hear(b"", 0.5)] == [b]


@pytest.mark.parametrize(("stalled_s", "frames", "skipped"), [(4.9, 3, 0), (5.0, 2, 23)])
def test_a_stream_that_stalls_within_a_frame_loses_it_only_after_a_while(stalled_s, frames, skipped):
    encoder, framer = Encoder(1, 1), Framer()
    a, b, c = (encoder.encode(dialect.MAVLink_system_time_message(1 << 50, 70_000 + n)) for n in range(3))
    came = framer.hear(a + b[:12], 0.0)
    for step in range(1, 50):
        came += framer.hear(b"", 0.1 * step)
    came += framer.hear(b"", stalled_s)
    came += framer.hear(b[12:] + c, stalled_s)
    assert len(came) == frames
    assert framer.counts["skipped"] == skipped


def test_a_frame_of_an_unknown_id_stands_beside_a_damaged_one():
    a, b, c = stream(3)
    strange = unknown_frame(b"some words")
    damaged = b[:-1] + bytes((b[-1] ^ 1,))
    assert take([a + strange + damaged + c]) == [a, strange, c]
    assert take([a + damaged + strange + c]) == [a, strange, c]
    assert take([a + damaged + strange + damaged + c]) == [a, c]


def hostile(rng, size):
    """Bytes of which nearly every one could begin a frame, with frames of known and unknown ids among them."""
    data = b""
    while len(data) < size:
        data += bytes(rng.choices(b"\xfd\xfe\x00\x01\xff", k=rng.randrange(1, 300)))
        data += rng.choice((b"", *stream(3), unknown_frame(bytes(rng.choices(b"\xfd\xfe\x00", k=40)))))
    return data


@pytest.mark.parametrize("seed", range(8))
def test_among_hostile_bytes_too_the_frames_are_the_same_however_the_stream_is_split(seed):
    rng = random.Random(seed)
    data = hostile(rng, 4000)
    whole = take([data])
    assert len(whole) > 5
    for largest in (1, 20, 600):
        chunks, at = [], 0
        while at < len(data):
            chunks.append(data[at : at + rng.randrange(1, largest + 1)])
            at += len(chunks[-1])
        assert take(chunks) == whole


@pytest.mark.parametrize(
    "pattern",
    [b"\xfe\x40", b"\xfe" * 5 + b"\x6e" * 5, b"\xfe" * 5 + b"\xc9" * 5, b"\xfd\xfd\x00\x00", b"\xfd", None],
)
def test_no_stream_makes_it_check_a_start_more_than_twice(pattern, monkeypatch):
    checked = 0

    def counting(data):
        nonlocal checked
        checked += 1
        return int(mcrf4xx(data))

    monkeypatch.setattr(framing, "mcrf4xx", counting)
    data = hostile(random.Random(1), 20_000) if pattern is None else pattern * (20_000 // len(pattern))
    _feed_in_pieces(data, 500)
    assert checked <= 2 * (data.count(b"\xfd") + data.count(b"\xfe"))
