"""The vehicle's recording is read by MAVLink FTP, and nothing else is, and nothing is ever written."""

import struct
import threading
import time
import zlib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink import mavftp
from pymavlink.dialects.v20 import ardupilotmega as dialect
from service_rig import Rig

from bridge.clock import SystemClock
from bridge.onboard import file_server as server_module
from bridge.onboard.file_server import FileServer, Segments, ThreadedFileServer
from bridge.wire.framing import Encoder, Framer, decode
from bridge.wire.ftp import Fault, Op, Packet, crc32
from bridge.wire.ftp import decode as unpacked

FIRST = "000001-0000000a-000001-0000000000.tlog"
SECOND = "000001-0000000a-000002-0000060000.tlog"
HELD = {FIRST: bytes(range(256)) * 20, SECOND: b"the newest"}
ME, OTHER = (0, 255, 190), (0, 254, 190)
FAST = 1e9


@pytest.fixture
def folder(tmp_path):
    place = tmp_path / "ring"
    place.mkdir()
    for name, data in HELD.items():
        (place / name).write_bytes(data)
    (place / "notes.txt").write_text("not for the ground")
    (tmp_path / "secret").write_text("outside")
    return place


@pytest.fixture
def server(folder):
    return FileServer(Segments(folder), lambda _: FAST)


def ask(server, packet, peer=ME, now_s=0.0):
    """All answers of one step."""
    server.hear(peer, packet.encode(), now_s)
    return [unpacked(payload) for to, payload in server.due(now_s) if to == peer]


def opened(server, name=FIRST, peer=ME, now_s=0.0):
    (answer,) = ask(server, Packet(1, 0, Op.OPEN_READ, len(name), data=name.encode()), peer, now_s)
    return answer


def fault_of(answers):
    (answer,) = answers
    return answer.op == Op.NAK and Fault(answer.data[0])


@given(
    st.builds(
        Packet,
        st.integers(0, 65535), st.integers(0, 255), st.integers(0, 255), st.just(0), st.integers(0, 255),
        st.booleans(), st.integers(0, 2**32 - 1),
    ),
    st.binary(max_size=239),
)  # fmt: skip
def test_a_packet_is_the_same_after_the_wire_has_cut_its_zeros(packet, data):
    sent = Packet(
        packet.sequence,
        packet.session,
        packet.op,
        len(data),
        packet.request,
        packet.complete,
        packet.offset,
        data,
    )
    assert unpacked(sent.encode().rstrip(b"\0")) == sent


def test_the_ring_is_listed_with_its_sizes_and_nothing_else_is(server):
    (answer,) = ask(server, Packet(1, 0, Op.LIST, 1, data=b"/"))
    assert answer.data == b"".join(f"F{name}\t{len(data)}\0".encode() for name, data in HELD.items())
    assert fault_of(ask(server, Packet(2, 0, Op.LIST, 1, offset=2, data=b"/"))) == Fault.END


def test_a_listing_stays_what_it_was_while_the_ring_moves_on(server, folder):
    ask(server, Packet(1, 0, Op.LIST, 1, data=b"/"))
    (folder / FIRST).unlink()
    (answer,) = ask(server, Packet(2, 0, Op.LIST, 1, offset=1, data=b"/"))
    assert answer.data == f"F{SECOND}\t{len(HELD[SECOND])}\0".encode()


def test_a_second_request_for_the_beginning_that_comes_late_leaves_the_listing_as_it_is(server, folder):
    first = Packet(1, 0, Op.LIST, 1, data=b"/")
    ask(server, first)
    (folder / FIRST).unlink()
    ask(server, first, now_s=2.0)
    (answer,) = ask(server, Packet(2, 0, Op.LIST, 1, offset=1, data=b"/"), now_s=2.1)
    assert answer.data == f"F{SECOND}\t{len(HELD[SECOND])}\0".encode()
    (answer,) = ask(server, first, now_s=60.0)
    assert answer.data == f"F{SECOND}\t{len(HELD[SECOND])}\0".encode()


def test_a_file_is_read_from_any_place_and_its_end_is_told(server):
    answer = opened(server)
    assert answer.op == Op.ACK
    assert int.from_bytes(answer.data, "little") == len(HELD[FIRST])
    (read,) = ask(server, Packet(9, answer.session, Op.READ, 100, offset=300))
    assert (read.sequence, read.request, read.offset) == (10, Op.READ, 300)
    assert read.data == HELD[FIRST][300:400]
    assert fault_of(ask(server, Packet(10, answer.session, Op.READ, 1, offset=len(HELD[FIRST])))) == Fault.END


def test_a_burst_gives_all_in_order_and_says_where_it_ends(server):
    session = opened(server).session
    answers = ask(server, Packet(5, session, Op.BURST, 239))
    assert b"".join(answer.data for answer in answers) == HELD[FIRST]
    assert [answer.sequence for answer in answers] == list(range(6, 6 + len(answers)))
    assert [answer.complete for answer in answers] == [False] * (len(answers) - 1) + [True]


@pytest.mark.parametrize(
    "name",
    ["/../secret", "../secret", "notes.txt", "/notes.txt", "{outside}/secret", "/etc/passwd", f"../ring/{FIRST}",
     FIRST[:-5], "", ".", "@PARAM/param.pck"],
)  # fmt: skip
def test_no_name_leads_out_of_the_ring(server, folder, name):
    data = name.format(outside=f"/{folder.parent}").encode()
    assert opened(server, data.decode()).data == bytes((Fault.NOT_FOUND,))
    answers = ask(server, Packet(1, 0, Op.CRC32, len(data), data=data)) + ask(server, Packet(2, 0, Op.NONE))
    assert [answer.request for answer in answers] == [Op.CRC32, Op.NONE]
    assert fault_of(answers[:1]) == Fault.NOT_FOUND


def test_a_link_in_the_ring_is_not_followed(server, folder):
    name = "000001-0000000a-000003-0000000000.tlog"
    (folder / name).symlink_to(folder.parent / "secret")
    assert opened(server, name).data == bytes((Fault.NOT_FOUND,))
    sum_of_it = ask(server, Packet(1, 0, Op.CRC32, len(name), data=name.encode()))
    assert fault_of(sum_of_it) == Fault.NOT_FOUND


@pytest.mark.parametrize(
    "op",
    [Op.CREATE, Op.WRITE, Op.REMOVE, Op.MAKE_FOLDER, Op.REMOVE_FOLDER, Op.OPEN_WRITE, Op.TRUNCATE, Op.RENAME],
)
def test_whatever_would_change_something_is_refused(server, folder, op):
    session = opened(server).session
    assert fault_of(ask(server, Packet(3, session, op, len(FIRST), data=FIRST.encode()))) == Fault.PROTECTED
    assert (folder / FIRST).read_bytes() == HELD[FIRST]


def test_a_session_is_its_own_peers_alone(server):
    session = opened(server).session
    assert fault_of(ask(server, Packet(3, session, Op.READ, 10), OTHER)) == Fault.SESSION
    ask(server, Packet(4, session, Op.TERMINATE), OTHER)
    ask(server, Packet(5, 0, Op.RESET), OTHER)
    assert ask(server, Packet(6, session, Op.READ, 10))[0].data == HELD[FIRST][:10]
    ask(server, Packet(7, session, Op.TERMINATE))
    assert fault_of(ask(server, Packet(8, session, Op.READ, 10))) == Fault.SESSION


def test_an_open_that_came_twice_is_one_session(server):
    assert opened(server).session == opened(server).session
    assert opened(server, SECOND).session != opened(server).session


def test_sessions_are_bounded_and_come_free_when_nobody_uses_them(server):
    peers = [(0, system, 1) for system in range(server_module.MOST_SESSIONS)]
    for peer in peers:
        assert opened(server, peer=peer).op == Op.ACK
    assert opened(server).data == bytes((Fault.NO_SESSIONS,))
    assert opened(server, now_s=31.0).op == Op.ACK


def test_who_never_ends_a_session_is_given_its_oldest_ones_room(server, folder):
    names = [f"000002-0000000b-{n:06d}-0000000000.tlog" for n in range(server_module.MOST_SESSIONS + 1)]
    for name in names:
        (folder / name).write_bytes(b"x")
    first, *others = [opened(server, name).session for name in names]
    assert others[-1] == first


def test_the_checksum_is_that_of_the_whole_file(server, monkeypatch):
    monkeypatch.setattr(server_module, "CRC_BYTES_A_STEP", 1000)
    answers = ask(server, Packet(1, 0, Op.CRC32, len(FIRST), data=FIRST.encode()))
    for _ in range(10):
        answers += ask(server, Packet(1, 0, Op.CRC32, len(FIRST), data=FIRST.encode())) if not answers else []
    (answer,) = answers
    assert int.from_bytes(answer.data, "little") == crc32(HELD[FIRST])
    assert crc32(HELD[FIRST][50:], crc32(HELD[FIRST][:50])) == crc32(HELD[FIRST])


def test_the_checksum_is_mavlinks():
    """CRC-32/JAMCRC's polynomial from 0, by its definition."""
    state = 0
    for byte in b"123456789":
        state ^= byte
        for _ in range(8):
            state = state >> 1 ^ (0xEDB88320 if state & 1 else 0)
    assert crc32(b"123456789") == state != zlib.crc32(b"123456789")


def test_answers_keep_to_the_links_pace_and_a_refusal_does_not_wait_for_it(folder):
    server = FileServer(Segments(folder), lambda _: 2660.0)
    session = opened(server).session
    server.hear(ME, Packet(5, session, Op.BURST, 239).encode(), 0.0)
    sent = sum(len(payload) + 27 for n in range(1, 21) for _, payload in server.due(n * 0.05))
    assert 2000 < sent < 3300
    server.hear(ME, Packet(7, 0, Op.OPEN_READ, 9, data=b"@PARAM/x.").encode(), 1.0)
    assert Fault.NOT_FOUND in [unpacked(payload).data[0] for _, payload in server.due(1.0)]


@settings(max_examples=300)
@given(st.lists(st.tuples(st.sampled_from([ME, OTHER, (1, 1, 1)]), st.binary(max_size=251)), max_size=30))
def test_nothing_that_comes_breaks_it(tmp_path_factory, heard):
    place = tmp_path_factory.getbasetemp() / "fuzzed"
    place.mkdir(exist_ok=True)
    (place / FIRST).write_bytes(HELD[FIRST])
    server = FileServer(Segments(place), lambda _: FAST)
    for n, (peer, payload) in enumerate(heard):
        server.hear(peer, payload, float(n))
        assert all(len(answer) <= 251 for _, answer in server.due(float(n)))
    assert [path.name for path in place.iterdir()] == [FIRST]
    assert opened(server, peer=(5, 5, 5)).op == Op.ACK


def request(packet):
    payload = list(packet.encode().ljust(251, b"\0"))
    return dialect.MAVLink_file_transfer_protocol_message(0, 1, 1, payload)


def test_a_bridge_refuses_parameters_as_a_file_in_the_same_step_and_hands_out_its_ring(folder):
    rig = Rig(files=FileServer(Segments(folder), lambda _: FAST))
    name = b"@PARAM/param.pck"
    (answer,) = rig.ask(request(Packet(7, 3, Op.OPEN_READ, len(name), data=name)))
    assert answer.payload[:6] == [8, 0, 3, 129, 1, 4]
    (answer,) = rig.ask(request(Packet(8, 0, Op.OPEN_READ, len(FIRST), data=FIRST.encode())))
    assert struct.unpack_from("<I", bytes(answer.payload), 12) == (len(HELD[FIRST]),)
    assert (answer.target_system, answer.target_component) == (255, 190)


class Wire:
    """A connection for pymavlink's FTP client, which speaks to a server."""

    source_system, source_component = 255, 190

    def __init__(self, served):
        self.served, self.encoder, self.back, self.framer = (
            served,
            Encoder(255, 190),
            Encoder(1, 191),
            Framer(),
        )
        self.mav = self
        self.inbox = []

    def file_transfer_protocol_send(self, network, system, component, payload):
        del network, system, component
        self.served.hear(ME, bytes(payload), 0.0)

    def recv_match(self, **_):
        for _, payload in self.served.due(0.0):
            message = dialect.MAVLink_file_transfer_protocol_message(
                0, 255, 190, list(payload.ljust(251, b"\0"))
            )
            self.inbox += [decode(frame) for frame in self.framer.feed(self.back.encode(message))]
        if self.inbox:
            return self.inbox.pop(0)
        time.sleep(0.002)
        return None


def test_pymavlinks_own_client_lists_and_reads_it(folder, tmp_path):
    served = ThreadedFileServer(FileServer(Segments(folder), lambda _: FAST), SystemClock())
    try:
        client = mavftp.MAVFTP(Wire(served), 1, 191)
        client.process_ftp_reply("ResetSessions", timeout=60)
        listed = client.cmd_list(["/"])
        assert [(entry.name, entry.size_b) for entry in listed.directory_listing] == [
            (n, len(d)) for n, d in HELD.items()
        ]
        for name, data in HELD.items():
            client.cmd_get([name, str(tmp_path / "got")])
            assert client.process_ftp_reply("OpenFileRO", timeout=60).error_code == 0
            assert (tmp_path / "got").read_bytes() == data
    finally:
        served.close()
    assert not any(thread.name == "file server" for thread in threading.enumerate())
