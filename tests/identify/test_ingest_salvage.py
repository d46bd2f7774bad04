"""The compiled walk gives what the careful path gives, record by record, whatever happened to the file."""

import random
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from fastcrc.crc16 import mcrf4xx
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mav

from bridge.framing import CRC_EXTRA, Encoder
from bridge.secret import KEY_AT, SETUP_SIGNING
from bridge.tlog import TlogReader
from identify.ingest.frames import Fields, load_frames, message_id
from identify.ingest.salvage import locate

SHARED = Path(__file__).resolve().parents[2].parent / "shared"
START_US = 1_790_000_000_000_000
HEARTBEAT = mav.MAVLink_heartbeat_message(12, 0, 128, 0, 4, 3)


def unknown_frame(payload: bytes) -> bytes:
    return bytes((0xFD, len(payload), 0, 0, 0, 7, 8)) + (60_123).to_bytes(3, "little") + payload + b"\x12\x34"


def heartbeat_frame(head: tuple[int, ...], payload: bytes) -> bytes:
    unsealed = bytes((head[0], len(payload), *head[1:])) + payload
    return unsealed + mcrf4xx(unsealed[1:] + CRC_EXTRA[0]).to_bytes(2, "little")


def signed_frame(payload: bytes) -> bytes:
    return heartbeat_frame((0xFD, 1, 0, 9, 2, 3, 0, 0, 0), payload) + bytes(range(13))


def old_frame() -> bytes:
    packed: bytes = HEARTBEAT.pack(mav.MAVLink(None, srcSystem=4, srcComponent=5), force_mavlink1=True)
    return packed


def records(seed: int, count: int) -> bytes:
    """Frames of every kind: MAVLink 1 and 2, signed, of an unknown id, of random payloads of any length."""
    rng = random.Random(seed)
    encoder = Encoder(1, 1)
    known = sorted(CRC_EXTRA)
    out = b""
    for i in range(count):
        kind = rng.randrange(12)
        if kind == 0:
            frame = old_frame()
        elif kind == 1:
            frame = signed_frame(rng.randbytes(9))
        elif kind == 2:
            frame = unknown_frame(rng.choice([rng.randbytes(9), b"\xfd" * 40, b""]))
        else:
            frame = encoder.frame(rng.choice(known), rng.randbytes(rng.randrange(1, 256)))
        step_us = rng.choice([0, 20, 5000, 150_000, -80_000, 3_600_000_000])
        out += (START_US + 5000 * i + step_us).to_bytes(8, "big") + frame
    return out


def flipped(data: bytes, rng: random.Random, every: int) -> bytes:
    damaged = bytearray(data)
    for _ in range(max(1, len(data) // every)):
        damaged[rng.randrange(len(damaged))] ^= 1 << rng.randrange(8)
    return bytes(damaged)


def keyless(number: int, payload: bytes) -> bytes:
    """What a frame that is read bears of a payload: nothing of a key that signs frames."""
    return payload[:KEY_AT].ljust(len(payload), b"\0") if number == SETUP_SIGNING else payload


def assert_alike(path: Path) -> None:
    """`locate` and TlogReader agree on every good frame, its time and every count."""
    reader = TlogReader(path)
    careful = [(stamp, frame) for stamp, frame in reader if frame.known]
    found = locate(path)
    assert found.counts == reader.counts
    assert set(found.counts) == set(reader.counts)
    assert found.stamp_us.tolist() == [stamp for stamp, _ in careful]
    for name in ("system", "component"):
        assert getattr(found, name).tolist() == [getattr(frame, name) for _, frame in careful]
    assert found.message.tolist() == [frame.message_id for _, frame in careful]
    content = found.data.tobytes()
    places = zip(found.message, found.start, found.length, strict=True)
    payloads = [keyless(number, content[a : a + n]) for number, a, n in places]
    assert payloads == [frame.payload for _, frame in careful]


@given(seed=st.integers(0, 10**6), cut=st.floats(0, 1), drop=st.integers(0, 40))
@settings(max_examples=40, deadline=None)
def test_a_file_cut_and_spliced_anywhere_is_read_alike(
    tmp_path_factory: pytest.TempPathFactory, seed: int, cut: float, drop: int
) -> None:
    path = tmp_path_factory.mktemp("cut") / "a.tlog"
    data = records(seed, 30)
    place = int(cut * len(data))
    for damaged in (old_record() + data[:place], old_record() + data[:place] + data[place + drop :]):
        path.write_bytes(damaged)
        assert_alike(path)


def old_record() -> bytes:
    """So that whatever follows is cut to, a recording stays one."""
    return START_US.to_bytes(8, "big") + old_frame()


@pytest.mark.parametrize("every", [30, 300, 3000])
def test_flipped_bits_are_read_alike(tmp_path: Path, every: int) -> None:
    rng = random.Random(every)
    path = tmp_path / "a.tlog"
    for seed in range(12):
        path.write_bytes(old_record() + flipped(records(seed, 60), rng, every))
        assert_alike(path)


def test_lost_and_wild_stamps_one_after_another_are_mended_alike(tmp_path: Path) -> None:
    rng = random.Random(4)
    frame = old_frame()
    path = tmp_path / "a.tlog"
    wild = (0, START_US, START_US + 90_000, START_US + 10**9, 2**63 + 5, 2**64 - 1, START_US - 10**9)
    mended = 0
    for count in (1, 2, 3, 40, 40, 40, 40, 40):
        stamps = [rng.choice(wild) if rng.random() < 0.6 else START_US + 5000 * i for i in range(count)]
        path.write_bytes(b"".join(stamp.to_bytes(8, "big") + frame for stamp in stamps))
        assert_alike(path)
        mended += locate(path).counts["stamps mended"]
    assert mended > 50


def test_frames_without_any_stamp_are_read_alike(tmp_path: Path) -> None:
    path = tmp_path / "a.tlog"
    path.write_bytes(old_frame() * 40)
    assert_alike(path)
    assert len(locate(path).start) == 40


def test_unknown_and_damaged_frames_are_counted_by_kind(tmp_path: Path) -> None:
    stamp = START_US.to_bytes(8, "big")
    good, broken = stamp + old_frame(), stamp + old_frame()[:-1] + b"\x00"
    path = tmp_path / "a.tlog"
    path.write_bytes(good + stamp + unknown_frame(bytes(9)) + good + broken + good + good[:-3])
    assert locate(path).counts == Counter(
        records=4, unknown=1, checksum=1, cut=1, skipped=len(broken) + len(good) - 3
    )


def test_every_byte_of_a_frame_is_under_its_checksum(tmp_path: Path) -> None:
    encoder = Encoder(1, 1)
    stamp = START_US.to_bytes(8, "big")
    path = tmp_path / "a.tlog"
    for length in (1, 7, 8, 9, 15, 16, 17):
        frame = encoder.frame(31, bytes(range(200, 200 + length)))
        for place in range(len(frame)):
            damaged = frame[:place] + bytes((frame[place] ^ 0x10,)) + frame[place + 1 :]
            path.write_bytes((stamp + old_frame()) * 2 + stamp + damaged + (stamp + old_frame()) * 2)
            assert set(locate(path).message) == {0}


@pytest.mark.parametrize(
    ("head", "size"),
    [((0xFE, 9, 2, 3, 0), 10), ((0xFD, 2, 0, 9, 2, 3, 0, 0, 0), 9), ((0xFC, 9, 2, 3, 0), 9)],
)
def test_a_frame_of_no_valid_form_is_none_though_its_checksum_is_right(
    tmp_path: Path, head: tuple[int, ...], size: int
) -> None:
    stamp = START_US.to_bytes(8, "big")
    path = tmp_path / "a.tlog"
    path.write_bytes(old_record() + stamp + heartbeat_frame(head, b"\1" * size) + old_record() * 3)
    assert_alike(path)
    assert len(locate(path).start) == 4


def test_a_field_is_what_the_full_payload_would_hold(tmp_path: Path) -> None:
    """MAVLink 2 cuts trailing zeros, so that a field may be there, half there or not at all."""
    encoder = Encoder(1, 1)
    values = [[1.5, -2.0], [0.0, 3.0], [0.0, 0.0], [2.0**-120, 0.0]]
    data = b""
    for pair in values:
        message = mav.MAVLink_debug_float_array_message(7, b"RPM", 256, [*pair, *[0.0] * 56])
        data += START_US.to_bytes(8, "big") + encoder.encode(message)
    first, second = tmp_path / "a.tlog", tmp_path / "b.tlog"
    first.write_bytes(data)
    second.write_bytes(old_record() + data)
    frames = load_frames([first, second])
    fields = Fields(frames, "DEBUG_FLOAT_ARRAY", frames.rows("DEBUG_FLOAT_ARRAY"))
    assert fields.first("data", 2).tolist() == values * 2
    assert fields["data"].shape == (8, 58)
    assert set(fields["name"]) == {b"RPM"}
    assert fields["time_usec"].tolist() == [7] * 8
    assert fields.at(np.array([5]))["data"][0, 1] == 3.0
    assert np.count_nonzero(frames.message == message_id("HEARTBEAT")) == 1


@pytest.mark.parametrize("name", ["sealed/open_1/check.tlog.gz", "data/ardusub_dives/small.tlog"])
def test_recordings_of_others_are_read_alike_whole_and_damaged(tmp_path: Path, name: str) -> None:
    source = SHARED / name
    if not source.exists():
        pytest.skip(f"{source} is not here")
    assert_alike(source)
    data = locate(source).data[:400_000].tobytes()
    path = tmp_path / "a.tlog"
    path.write_bytes(flipped(data, random.Random(1), 1000))
    assert_alike(path)
