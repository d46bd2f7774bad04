"""Keys and file contents are in no recording, go into no file written here, and onto no link."""

import gzip
import random
from itertools import islice, product
from typing import Any

import pytest
from lying_vehicle import Vehicle
from pymavlink.dialects.v20 import ardupilotmega as dialect
from soak import rest_in_soak
from test_fetching import KEPT, LONGEST_S, PATIENCE_S, SEGMENTS, VEHICLE, heard, ring, segment

from bridge import exit_codes
from bridge.clock import SimulatedClock
from bridge.links.link import memory_pair
from bridge.wire.framing import CRC_EXTRA, Encoder, Framer, decode
from bridge.wire.ftp import Fault, Op, Packet, acknowledged, refused
from bridge.wire.ftp import decode as packet_of
from bridge.wire.redaction import carries_key, without_contents, without_key
from bridge.wire.tlog import TlogWriter, read_tlog, record_of
from bridge.wire.whole_recording import WHOLE
from gcs_plugin.dives.folder import About, DiveFolder
from gcs_plugin.dives.replay import Reel
from gcs_plugin.fetch.merging import write_records
from gcs_plugin.recording.recorder import Notice, Recorder
from tui import cli
from tui.commands.fetch import Fetcher
from tui.commands.import_ import DAMAGE_OUT, _copy

KEY = bytes(range(100, 132))


def setup(key=KEY, signed=False):
    link = dialect.MAVLink(None, srcSystem=255, srcComponent=190)
    link.signing.secret_key, link.signing.sign_outgoing = b"s" * 32, signed
    raw: bytes = dialect.MAVLink_setup_signing_message(1, 1, list(key), 7_000_000).pack(link)
    return raw


@pytest.mark.parametrize("signed", [False, True])
def test_the_key_is_zeros_and_all_else_is_as_it_was(signed):
    raw = setup(signed=signed)
    kept = without_key(raw)
    before, after = (decode(Framer().feed(frame)[0]) for frame in (raw, kept))
    assert bytes(before.secret_key) == KEY
    expected = before.to_dict() | {"secret_key": [0] * 32}
    assert after.to_dict() == expected
    assert len(kept) == len(raw) - (13 if signed else 0)
    assert (after.get_srcSystem(), after.get_srcComponent()) == (255, 190)


def test_no_byte_of_a_key_is_left_however_short_the_payload():
    payload = b"\x07" * 10 + b"\xaa" * 32
    for length in range(1, 43):
        kept = without_key(Encoder(1, 1).frame(256, payload[:length]))
        assert b"\xaa" not in kept[10:-2], length
        assert [frame.known for frame in Framer().feed(kept)] == [True], length


def test_every_other_frame_is_kept_as_it_is():
    for message in (
        dialect.MAVLink_heartbeat_message(12, 0, 128, 0, 4, 3),
        dialect.MAVLink_system_time_message(1_790_000_000_000_000, 256),
    ):
        for old in (False, True):
            raw = message.pack(dialect.MAVLink(None, 1, 1), force_mavlink1=old)
            assert without_key(raw) is raw
    assert without_key(b"") == b""


class Hub:
    def __init__(self, *waiting):
        self.waiting, self.heard = list(waiting), b""

    def broadcast(self, raw):
        self.heard += raw

    def taken(self):
        taken, self.waiting = self.waiting, []
        return taken


def test_a_key_goes_through_the_recorder_neither_way_and_its_frame_is_counted(tmp_path):
    said: list[Notice] = []
    ours, theirs = memory_pair()
    heartbeat: Any = Encoder(1, 1).encode(dialect.MAVLink_heartbeat_message(12, 0, 128, 0, 4, 3))
    hub = Hub(setup(), heartbeat)
    theirs.write(setup() + heartbeat)
    path = tmp_path / "telemetry.tlog"
    recorder = Recorder(
        [ours], lambda _: TlogWriter(path), SimulatedClock(), lambda: 10**9, said.append, outlet=hub
    )
    recorder.step(0.0)
    assert recorder.count.heard == 2
    assert recorder.count.frames == 3
    recorder.close()
    assert hub.heard == heartbeat
    assert theirs.read(0.0) == heartbeat
    assert KEY[:4] not in path.read_bytes()
    assert [carries_key(frame.raw) for _, frame in read_tlog(path)] == [True, False, False]
    assert [notice.level for notice in said] == ["warning"]
    assert "set it up on the vehicle's own cable" in said[0].sentence


START_US = 1_790_000_000_000_000
CONTENTS = record_of(START_US, b"") + setup()
ASKED = {op: Packet(7, 3, op, 80, offset=1000) for op in (Op.READ, Op.BURST, Op.LIST, Op.CRC32)}
FILLED = [
    acknowledged(ASKED[Op.READ], CONTENTS),
    acknowledged(ASKED[Op.READ], KEY[:1]),
    acknowledged(ASKED[Op.READ], (CONTENTS * 4)[:239]),
    acknowledged(ASKED[Op.BURST], CONTENTS),
    Packet(7, 3, Op.WRITE, len(CONTENTS), offset=5, data=CONTENTS),
]
OTHERS = [
    *ASKED.values(),
    acknowledged(ASKED[Op.LIST], b"F000001-00000007-000001-0000000000.tlog\t9\0"),
    acknowledged(ASKED[Op.CRC32], b"abcd"),
    acknowledged(ASKED[Op.READ]),
    refused(ASKED[Op.READ], Fault.END),
]


def framed(packet, is_old=False, signed=False):
    link = dialect.MAVLink(None, srcSystem=1, srcComponent=191)
    link.signing.secret_key, link.signing.sign_outgoing = b"s" * 32, signed
    payload = packet.encode().ljust(251, b"\0")
    message = dialect.MAVLink_file_transfer_protocol_message(0, 255, 190, list(payload))
    raw: bytes = message.pack(link, force_mavlink1=is_old)
    return raw


def packet_in(raw):
    (frame,) = Framer().feed(raw) or Framer().flush()
    message = decode(frame)
    assert (frame.system, frame.component) == (1, 191)
    assert (message.target_network, message.target_system, message.target_component) == (0, 255, 190)
    return packet_of(bytes(message.payload))


@pytest.mark.parametrize(("is_old", "signed"), [(False, False), (False, True), (True, False)])
def test_bytes_of_a_file_are_zeros_and_all_else_is_as_it_was(is_old, signed):
    for packet in FILLED:
        raw = framed(packet, is_old, signed)
        kept = without_contents(raw)
        before, after = packet_in(raw), packet_in(kept)
        assert before.data == packet.data
        assert after.data == bytes(len(packet.data))
        assert (after.sequence, after.session, after.op, after.request) == (
            packet.sequence, packet.session, packet.op, packet.request,
        )  # fmt: skip
        assert (after.size, after.offset) == (packet.size, packet.offset)
        assert len(kept) == len(raw) - (13 if signed else 0)


@pytest.mark.parametrize("is_old", [False, True])
def test_every_frame_but_contents_is_kept_as_it_is(is_old):
    for packet in OTHERS:
        raw = framed(packet, is_old)
        assert without_contents(raw) is raw
    beat = dialect.MAVLink_heartbeat_message(12, 0, 128, 0, 4, 3)
    raw = beat.pack(dialect.MAVLink(None, 1, 1), force_mavlink1=is_old)
    assert without_contents(raw) is raw
    assert without_contents(b"") == b""


def test_a_file_goes_through_the_recorder_and_its_recording_holds_none_of_it(tmp_path):
    ours, theirs = memory_pair()
    path, hub = tmp_path / "telemetry.tlog", Hub(framed(FILLED[-1]))
    frames = b"".join(framed(packet) for packet in FILLED[:-1])
    theirs.write(frames)
    recorder = Recorder(
        [ours], lambda _: TlogWriter(path), SimulatedClock(), lambda: 10**9, lambda _: None, outlet=hub
    )
    recorder.step(0.0)
    assert recorder.count.frames == len(FILLED)
    recorder.close()
    assert hub.heard == frames
    assert theirs.read(0.0) == framed(FILLED[-1])
    assert not any(KEY[at : at + 4] in path.read_bytes() for at in range(len(KEY)))
    assert [packet_in(frame.raw).size for _, frame in read_tlog(path)] == [item.size for item in FILLED]


SETUP = 256
COUNT = 60


def foreign(path, *more):
    """Another program's recording: frames of a vehicle, a key among them, and damage at the end."""
    encoder = Encoder(1, 1)
    frames = [
        encoder.encode(dialect.MAVLink_attitude_message(50 * n, 0.1, 0.2, 0.01 * n, 0.0, 0.0, 0.0))
        for n in range(COUNT)
    ]
    frames[COUNT // 2 : COUNT // 2] = [setup(), setup(signed=True)]
    data = b"".join(
        (START_US + 50_000 * n).to_bytes(8, "big") + raw for n, raw in enumerate([*frames, *more])
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(gzip.compress(data) if path.suffix == ".gz" else data)
    return path


def damaged():
    raw = bytearray(setup())
    raw[-1] ^= 1
    return bytes(raw)


def read_tlog_raw(path):
    return [(stamp_us, frame.raw) for stamp_us, frame in read_tlog(path)]


def said(capsys):
    captured = capsys.readouterr()
    return " ".join((captured.out + captured.err).split())


def keyless(folder):
    """Whether no byte of a key is in any file of a folder."""
    files = [path for path in folder.rglob("*") if path.is_file()]
    assert files
    return all(KEY[:4] not in path.read_bytes() for path in files)


def test_no_frame_that_is_read_bears_a_key(tmp_path):
    path = foreign(tmp_path / "other.tlog", *map(framed, FILLED))
    assert path.read_bytes().count(KEY) > len(FILLED)
    read = [frame for _, frame in read_tlog(path)]
    assert [frame.message_id for frame in read].count(SETUP) == 2
    assert not any(KEY[:4] in frame.raw for frame in read)
    shown = [frame for _, frame in Reel([path]).between(0.0, 60.0)]
    assert len(shown) == COUNT + 2 + len(FILLED)
    assert not any(KEY[:4] in frame.raw for frame in shown)


def test_an_imported_recording_goes_without_its_damage_and_says_so(tmp_path, capsys):
    source, out = tmp_path / "other.tlog", tmp_path / "dives" / "a"
    write_records(source, read_tlog_raw(foreign(tmp_path / "one.tlog")))
    hurt = bytearray(source.read_bytes())
    hurt[30] ^= 1
    source.write_bytes(hurt)
    assert cli.main(["import", str(source), "--out", str(out)]) == exit_codes.DONE
    assert f"{out}. {DAMAGE_OUT}" in said(capsys)
    assert read_tlog_raw(out / "telemetry.tlog") == read_tlog_raw(source)


@pytest.mark.parametrize("name", ["other.tlog", "other.tlog.gz"])
def test_an_imported_recording_goes_without_it(tmp_path, name):
    source, out = foreign(tmp_path / name, damaged()), tmp_path / "dives" / "a"
    before = source.read_bytes()
    assert cli.main(["import", str(source), "--out", str(out)]) == exit_codes.DONE
    assert keyless(out)
    assert source.read_bytes() == before
    kept = [(stamp_us, frame.raw) for stamp_us, frame in read_tlog(out / "telemetry.tlog")]
    assert kept == [(stamp_us, frame.raw) for stamp_us, frame in read_tlog(source)]


def test_what_is_merged_goes_without_it(tmp_path):
    dive, other = tmp_path / "2026-11-20T0912Z-lake", foreign(tmp_path / "other.tlog")
    foreign(dive / "telemetry.tlog")
    assert cli.main(["merge", str(dive), str(other)]) == exit_codes.DONE
    whole = (dive / WHOLE).read_bytes()
    assert KEY[:4] not in whole
    assert SETUP in {frame.message_id for _, frame in read_tlog(dive / WHOLE)}


def test_a_replay_sends_none_and_says_how_many_it_left_out(tmp_path, monkeypatch, capsys):
    ours, theirs = memory_pair()
    monkeypatch.setattr("bridge.links.open.open_link", lambda _: ours)
    words = ["replay", str(foreign(tmp_path / "other.tlog")), "--link", "any", "--speed", "1e6"]
    assert cli.main(words) == exit_codes.DONE
    data = b""
    while theirs._inbox:
        data += theirs.read(0.0)
    sent = Framer().feed(data)
    assert len(sent) == COUNT
    assert SETUP not in {frame.message_id for frame in sent}
    assert "60 frames sent to" in (text := said(capsys))
    assert "2 of SETUP_SIGNING left out, which would set a key to sign with" in text


@pytest.mark.parametrize("anew", [False, True])
def test_what_is_fetched_goes_without_it(tmp_path, anew):
    dive, place = heard(tmp_path), ring(tmp_path / "ring", SEGMENTS)
    kept = [*KEPT[1][:9], (KEPT[1][9][0], setup()), *KEPT[1][9:]]
    (place / segment(1).name).write_bytes(
        b"".join(stamp_us.to_bytes(8, "big") + raw for stamp_us, raw in kept)
    )
    vehicle = Vehicle(place, None, random.Random(0), 1e9, LONGEST_S)
    fetcher = Fetcher(vehicle, vehicle.world, PATIENCE_S, lambda *_: None)
    made = (
        fetcher.new(dive.path.parent, VEHICLE, None, "new", About())
        if anew
        else fetcher.whole(DiveFolder(dive.path))
    )
    assert keyless(made.path.parent)


def bears(data):
    """Whether any four bytes of a key in a row are there."""
    return any(KEY[at : at + 4] in data for at in range(0, len(KEY), 4))


def leaves_none(tmp_path, raw, after):
    """Whether no byte of a key comes out of a recording of other frames and this one, read, imported or written."""
    source, out = tmp_path / "other.tlog", tmp_path / "out"
    out.mkdir(exist_ok=True)
    source.write_bytes(BEFORE + START_US.to_bytes(8, "big") + raw + after)
    _copy(source, out)
    return not any(
        bears(data)
        for data in (
            (out / "telemetry.tlog").read_bytes(),
            b"".join(frame.raw for _, frame in read_tlog(source)),
        )
    )


OTHER_FRAMES = [
    Encoder(1, 1).encode(dialect.MAVLink_attitude_message(50 * n, 0.1, 0.2, 0.01 * n, 0.0, 0.0, 0.0))
    for n in range(4)
]
BEFORE = b"".join(record_of(START_US + n, raw) for n, raw in enumerate(OTHER_FRAMES))


@pytest.mark.parametrize("every", rest_in_soak([7, 1]))
@pytest.mark.parametrize("after", [b"", BEFORE], ids=["at the end", "in the middle"])
@pytest.mark.parametrize("signed", [False, True])
def test_whichever_bit_of_a_frame_with_a_key_is_damaged_no_file_of_ours_has_it(
    tmp_path, signed, after, every
):
    true = setup(signed=signed)
    for at, bit in islice(product(range(len(true)), range(8)), 0, None, every):
        raw = bytearray(true)
        raw[at] ^= 1 << bit
        assert leaves_none(tmp_path, bytes(raw), after), (at, bit)


def test_whatever_a_byte_of_its_time_becomes_no_file_of_ours_has_the_key(tmp_path):
    for at in range(8):
        before = bytearray(BEFORE + START_US.to_bytes(8, "big"))
        before[at - 8] ^= 0xFF
        path = tmp_path / "other.tlog"
        path.write_bytes(bytes(before) + setup() + BEFORE)
        assert not bears(b"".join(frame.raw for _, frame in read_tlog(path)))


def test_frames_that_are_near_to_one_with_a_key_are_kept_as_they_are():
    """Intact ones of known kinds with numbers next to it, and damaged ones that were none."""
    unknown = b"\xfd\x20\0\0\0\1\1\0\1\1" + bytes(range(1, 35))
    near = [raw for number in range(257, 280) if number in CRC_EXTRA for raw in [_long(number)]]
    for raw in (*near, unknown, *(raw[:-1] + b"\0" for raw in near)):
        assert without_key(raw) is raw


def _long(number):
    return Encoder(1, 1).frame(number, bytes(range(1, 43)))
