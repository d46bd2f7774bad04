"""A recording gives back every intact frame, whatever happened to the file."""

import gzip
import os
import random
import subprocess
import sys
from pathlib import Path

import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.errors import LogError
from bridge.wire.framing import Encoder
from bridge.wire.tlog import TlogReader, TlogWriter, read_tlog

SHARED = Path(__file__).resolve().parents[2].parent / "shared"
START_US = 1_790_000_000_000_000


def records(count):
    encoder = Encoder(1, 1)
    every = (
        dialect.MAVLink_heartbeat_message(12, 0, 128, 0, 4, 3),
        dialect.MAVLink_named_value_float_message(5, b"FF_MODE", 2.5),
        dialect.MAVLink_statustext_message(6, b"ready"),
    )
    return [(START_US + 5000 * i, encoder.encode(every[i % len(every)])) for i in range(count)]


def to_bytes(log):
    return b"".join(stamp.to_bytes(8, "big") + raw for stamp, raw in log)


def read(path):
    return [(stamp, frame.raw) for stamp, frame in read_tlog(path)]


def unknown_frame(payload):
    return bytes((0xFD, len(payload), 0, 0, 0, 7, 8)) + (60_123).to_bytes(3, "little") + payload + b"\x12\x34"


def test_what_is_written_is_read_and_is_in_the_file_at_once(tmp_path):
    path = tmp_path / "dive.tlog"
    with TlogWriter(path) as writer:
        for i, (stamp, raw) in enumerate(records(20)):
            writer.write(stamp, raw)
            assert path.read_bytes() == to_bytes(records(20)[: i + 1])
        writer.sync()
    assert read(path) == records(20)


def test_a_recording_is_never_overwritten(tmp_path):
    path = tmp_path / "dive.tlog"
    path.write_bytes(b"precious")
    with pytest.raises(LogError, match="never overwritten"):
        TlogWriter(path)
    assert path.read_bytes() == b"precious"


def test_a_folder_that_is_not_there_is_named(tmp_path):
    with pytest.raises(LogError, match="No such file or directory"):
        TlogWriter(tmp_path / "nowhere" / "dive.tlog")


def test_a_full_disk_is_an_error_that_names_the_file():
    if not Path("/dev/full").exists():
        pytest.skip("this system has no /dev/full")
    writer = TlogWriter.__new__(TlogWriter)
    writer.path, writer._file = Path("dive.tlog"), os.open("/dev/full", os.O_WRONLY)
    with writer, pytest.raises(LogError, match=r"dive\.tlog.*No space left"):
        writer.write(START_US, b"x")


def test_a_killed_writer_loses_nothing_that_it_had_acknowledged(tmp_path):
    code = (
        "import sys; from pathlib import Path; from bridge.wire.tlog import TlogWriter\n"
        "from bridge.wire.framing import Encoder\n"
        "w, e = TlogWriter(Path(sys.argv[1])), Encoder(1, 1)\n"
        "for i in range(10**6):\n"
        "    w.write(1790000000000000 + i, e.frame(0, b'123456789'))\n"
        "    sys.stdout.write(f'{i}\\n'); sys.stdout.flush()\n"
    )
    path = tmp_path / "dive.tlog"
    child = subprocess.Popen([sys.executable, "-c", code, str(path)], stdout=subprocess.PIPE)
    acknowledged = [int(child.stdout.readline()) for _ in range(300)]
    child.kill()
    lines = child.stdout.read().split(b"\n")[:-1]
    child.stdout.close()
    child.wait()
    stamps = [stamp - START_US for stamp, _ in read(path)]
    assert stamps[: 300 + len(lines)] == acknowledged + [int(line) for line in lines]


@pytest.mark.parametrize("packed", [False, True])
def test_a_file_cut_at_any_byte_gives_every_whole_record(tmp_path, packed):
    log = records(9)
    whole = to_bytes(log)
    ends = [len(to_bytes(log[: i + 1])) for i in range(len(log))]
    path = tmp_path / ("cut.tlog.gz" if packed else "cut.tlog")
    for cut in range(ends[0], len(whole) + 1):
        path.write_bytes(_gzip_without_end(whole[:cut]) if packed else whole[:cut])
        reader = TlogReader(path)
        assert [(s, f.raw) for s, f in reader] == log[: sum(end <= cut for end in ends)], cut
        assert reader.counts["cut"] == int(packed or cut not in ends), cut
        assert reader.counts["checksum"] == 0


def _gzip_without_end(data):
    return gzip.compress(data, compresslevel=0)[:-8]


def test_a_gzip_file_cut_anywhere_gives_what_is_there(tmp_path):
    log = records(3000)
    packed = gzip.compress(to_bytes(log))
    path = tmp_path / "cut.tlog.gz"
    for cut in range(1500, len(packed), 997):
        path.write_bytes(packed[:cut])
        result = read(path)
        assert result == log[: len(result)]
        assert len(result) > 0.5 * len(log) * cut / len(packed)
    path.write_bytes(packed)
    assert read(path) == log


def test_one_flipped_bit_in_a_thousand_bytes_costs_only_the_frames_it_hit(tmp_path):
    rng = random.Random(8)
    log = records(4000)
    damaged = bytearray(to_bytes(log))
    owner = [(i, byte < 8) for i, (_, raw) in enumerate(log) for byte in range(8 + len(raw))]
    hurt, late = set(), set()
    for block in range(0, len(damaged), 1000):
        place = min(block + rng.randrange(1000), len(damaged) - 1)
        damaged[place] ^= 1 << rng.randrange(8)
        record, in_stamp = owner[place]
        (late if in_stamp else hurt).add(record)
    path = tmp_path / "flipped.tlog"
    path.write_bytes(damaged)
    reader = TlogReader(path)
    intact = [(stamp, raw) for i, (stamp, raw) in enumerate(log) if i not in hurt]
    results = [(stamp, frame.raw) for stamp, frame in reader if frame.known]
    assert [raw for _, raw in results] == [raw for _, raw in intact]
    assert len(late) > 5
    assert all(abs(got - true) <= 110_000 for (got, _), (true, _) in zip(results, intact, strict=True))
    # A flipped length may reach past the next frame: one loss then covers two.
    assert 0 < reader.counts["checksum"] + reader.counts["unknown"] <= len(hurt)


LOG = records(12)
HEAD, TAIL = to_bytes(LOG[:5]), to_bytes(LOG[5:])
SET = [(stamp + (86_400_000_000 if 4 <= i < 8 else 0), raw) for i, (stamp, raw) in enumerate(LOG)]


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        *((HEAD + junk + TAIL, LOG) for junk in (b"\xfd" * 37, b"\x00" * 11, bytes(range(256)))),
        (HEAD + unknown_frame(bytes(9))[:-4] + TAIL, LOG),
        (HEAD + TAIL[20:], LOG[:5] + LOG[6:]),
        (HEAD + TAIL[1:], [*LOG[:5], (LOG[4][0], LOG[5][1]), *LOG[6:]]),
        (to_bytes(SET), SET),
    ],
    ids=[
        "inserted",
        "zeros",
        "all bytes",
        "cut frame",
        "missing",
        "stamp without a byte",
        "clock set meanwhile",
    ],
)
def test_damage_costs_the_record_that_it_hits_alone_and_a_lost_stamp_is_its_neighbours(
    tmp_path, data, expected
):
    path = tmp_path / "dive.tlog"
    path.write_bytes(data)
    assert read(path) == expected


def test_the_stamps_of_a_slow_recording_stand_where_its_clock_was_set_back(tmp_path):
    slow = [(LOG[0][0] + 200_000 * i, raw) for i, (_, raw) in enumerate(LOG)]
    back = [(stamp - (3_600_000_000 if i >= 5 else 0), raw) for i, (stamp, raw) in enumerate(slow)]
    path = tmp_path / "dive.tlog"
    path.write_bytes(to_bytes(back))
    assert read(path) == back


def test_an_unknown_id_is_kept_unchecked(tmp_path):
    log = records(4)
    log.insert(2, (log[1][0] + 1, unknown_frame(b"\xfd" * 30)))
    path = tmp_path / "unknown.tlog"
    path.write_bytes(to_bytes(log))
    reader = TlogReader(path)
    result = list(reader)
    assert [(stamp, frame.raw) for stamp, frame in result] == log
    assert [frame.known for _, frame in result] == [True, True, False, True, True]
    assert reader.counts == {"records": 5, "unknown": 1}


def test_a_false_record_that_ends_where_a_record_ends_hides_nothing(tmp_path):
    log = records(5)
    hidden = to_bytes(log[1:3])
    false_record = log[0][0].to_bytes(8, "big") + unknown_frame(hidden)[:10]
    # The last two bytes of the hidden records stand where the false one has its checksum.
    false_record = false_record[:9] + bytes((len(hidden) - 2,)) + false_record[10:]
    path = tmp_path / "false.tlog"
    path.write_bytes(to_bytes(log[:1]) + false_record + hidden + to_bytes(log[3:]))
    assert read(path) == log


@pytest.mark.parametrize("content", [b"", b"time,u,v\n1,2,3\n" * 50, bytes(1000), b"\x1f\x8bnot gzip at all"])
def test_what_is_no_recording_is_named_in_one_sentence(tmp_path, content):
    path = tmp_path / "notes.tlog"
    path.write_bytes(content)
    with pytest.raises(LogError, match=r"notes\.tlog: .*; give") as caught:
        read(path)
    assert "\n" not in str(caught.value)


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(LogError, match=r"gone\.tlog: no such file"):
        read(tmp_path / "gone.tlog")
    with pytest.raises(LogError, match="can't be read"):
        read(tmp_path)


def test_pymavlink_reads_our_recording_alike(tmp_path):
    path = tmp_path / "dive.tlog"
    with TlogWriter(path) as writer:
        for stamp, raw in records(30):
            writer.write(stamp, raw)
    stock = mavutil.mavlink_connection(str(path))
    results = []
    while (message := stock.recv_match()) is not None:
        results.append((round(message._timestamp * 1e6), bytes(message.get_msgbuf())))
    stock.close()
    assert [raw for _, raw in results] == [raw for _, raw in records(30)]
    assert all(abs(a - b[0]) < 4 for (a, _), b in zip(results, records(30), strict=True))


@pytest.mark.parametrize("dive", ["open_1/dive", "d/check"])
def test_a_foreign_recording_is_read_whole(dive):
    path = SHARED / "sealed" / f"{dive}.tlog.gz"
    if not path.exists():
        pytest.skip(f"{path} is not here")
    reader = TlogReader(path)
    total = sum(len(frame.raw) + 8 for _, frame in reader)
    assert total == len(gzip.decompress(path.read_bytes()))
    assert set(reader.counts) == {"records"}
