"""What files hold that go by on a link is in no recording: a key may lie in a vehicle's file, cut at any place."""

from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect
from test_keys_stay_out_of_recordings import KEY, Hub, setup

from bridge.clock import SimulatedClock
from bridge.framing import Framer, decode
from bridge.ftp.contents import without_contents
from bridge.ftp.packet import DATA_BYTES, Fault, Op, Packet, acknowledged, refused
from bridge.ftp.packet import decode as packet_of
from bridge.link.memory import memory_pair
from bridge.tlog import TlogWriter, read_tlog, record_of
from gcs_plugin.recorder import Recorder

START_US = 1_790_000_000_000_000
CONTENTS = record_of(START_US, b"") + setup()
ASKED = {op: Packet(7, 3, op, 80, offset=1000) for op in (Op.READ, Op.BURST, Op.LIST, Op.CRC32)}
FILLED = [
    acknowledged(ASKED[Op.READ], CONTENTS),
    acknowledged(ASKED[Op.READ], KEY[:1]),
    acknowledged(ASKED[Op.READ], (CONTENTS * 4)[:DATA_BYTES]),
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


def framed(packet: Packet, is_old: bool = False, signed: bool = False) -> bytes:
    link = dialect.MAVLink(None, srcSystem=1, srcComponent=191)
    link.signing.secret_key, link.signing.sign_outgoing = b"s" * 32, signed
    payload = packet.encode().ljust(251, b"\0")
    message = dialect.MAVLink_file_transfer_protocol_message(0, 255, 190, list(payload))
    raw: bytes = message.pack(link, force_mavlink1=is_old)
    return raw


def packet_in(raw: bytes) -> Packet:
    (frame,) = Framer().feed(raw) or Framer().flush()
    message = decode(frame)
    assert message is not None
    assert (frame.system, frame.component) == (1, 191)
    assert (message.target_network, message.target_system, message.target_component) == (0, 255, 190)
    return packet_of(bytes(message.payload))


@pytest.mark.parametrize(("is_old", "signed"), [(False, False), (False, True), (True, False)])
def test_bytes_of_a_file_are_zeros_and_all_else_is_as_it_was(is_old: bool, signed: bool) -> None:
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
def test_every_other_frame_is_kept_as_it_is(is_old: bool) -> None:
    for packet in OTHERS:
        raw = framed(packet, is_old)
        assert without_contents(raw) is raw
    beat = dialect.MAVLink_heartbeat_message(12, 0, 128, 0, 4, 3)
    raw = beat.pack(dialect.MAVLink(None, 1, 1), force_mavlink1=is_old)
    assert without_contents(raw) is raw
    assert without_contents(b"") == b""


def test_a_file_goes_through_the_recorder_and_its_recording_holds_none_of_it(tmp_path: Path) -> None:
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
    assert [packet_in(frame.raw).size for _, frame in read_tlog(path)] == [one.size for one in FILLED]


def test_what_another_program_recorded_is_read_without_it(tmp_path: Path) -> None:
    path = tmp_path / "other.tlog"
    path.write_bytes(b"".join(record_of(START_US, b"") + framed(packet) for packet in FILLED))
    assert KEY in path.read_bytes()
    read = [frame for _, frame in read_tlog(path)]
    assert [frame.known for frame in read] == [True] * len(FILLED)
    assert not any(KEY[:4] in frame.raw for frame in read)
