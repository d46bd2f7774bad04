"""The key that signs frames is in no recording, and goes through the recorder neither way."""

from pathlib import Path
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SimulatedClock
from bridge.framing import Encoder, Framer, decode
from bridge.link.memory import memory_pair
from bridge.secret import carries_key, without_key
from bridge.tlog import TlogWriter, read_tlog
from gcs_plugin.recorder import Notice, Recorder

KEY = bytes(range(100, 132))


def setup(key: bytes = KEY, signed: bool = False) -> bytes:
    link = dialect.MAVLink(None, srcSystem=255, srcComponent=190)
    link.signing.secret_key, link.signing.sign_outgoing = b"s" * 32, signed
    raw: bytes = dialect.MAVLink_setup_signing_message(1, 1, list(key), 7_000_000).pack(link)
    return raw


@pytest.mark.parametrize("signed", [False, True])
def test_the_key_is_zeros_and_all_else_is_as_it_was(signed: bool) -> None:
    raw = setup(signed=signed)
    kept = without_key(raw)
    before, after = (decode(Framer().feed(frame)[0]) for frame in (raw, kept))
    assert before is not None
    assert after is not None
    assert bytes(before.secret_key) == KEY
    expected = before.to_dict() | {"secret_key": [0] * 32}
    assert after.to_dict() == expected
    assert len(kept) == len(raw) - (13 if signed else 0)
    assert (after.get_srcSystem(), after.get_srcComponent()) == (255, 190)


@pytest.mark.parametrize("length", range(1, 43))
def test_no_byte_of_a_key_is_left_however_short_the_payload(length: int) -> None:
    payload = b"\x07" * 10 + b"\xaa" * 32
    kept = without_key(Encoder(1, 1).frame(256, payload[:length]))
    assert b"\xaa" not in kept[10:-2]
    assert [frame.known for frame in Framer().feed(kept)] == [True]


def test_every_other_frame_is_kept_as_it_is() -> None:
    for message in (
        dialect.MAVLink_heartbeat_message(12, 0, 128, 0, 4, 3),
        dialect.MAVLink_system_time_message(1_790_000_000_000_000, 256),
    ):
        for old in (False, True):
            raw = message.pack(dialect.MAVLink(None, 1, 1), force_mavlink1=old)
            assert without_key(raw) is raw
    assert without_key(b"") == b""


def test_a_recording_holds_the_frame_without_its_key(tmp_path: Path) -> None:
    path = tmp_path / "telemetry.tlog"
    with TlogWriter(path) as writer:
        for n in range(3):
            writer.write(1_790_000_000_000_000 + n, setup())
    assert KEY[:4] not in path.read_bytes()
    assert [frame.message_id for _, frame in read_tlog(path)] == [256] * 3


class Hub:
    def __init__(self, *waiting: bytes) -> None:
        self.waiting, self.heard = list(waiting), b""

    def broadcast(self, raw: bytes) -> None:
        self.heard += raw

    def taken(self) -> list[bytes]:
        taken, self.waiting = self.waiting, []
        return taken


def test_a_key_goes_through_the_recorder_neither_way_and_its_frame_is_counted(tmp_path: Path) -> None:
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
