"""A signed link: accepted and refused frames, and the warnings to the crew."""

import json
from threading import Event

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect
from waiting import until

from bridge.clock import SimulatedClock
from bridge.links.link import memory_pair
from bridge.signing.key import SigningKey, is_signed, new_key, signed
from bridge.signing.link import EPOCH_UNIX_S, STEPS_A_S, Gate, Refusal, SignedLink, Times, Trouble
from bridge.wire.framing import Encoder, Framer

BEAT = dialect.MAVLink_heartbeat_message(12, 0, 0, 0, 4, 3)
KEY = SigningKey(bytes(range(32)))
PATIENCE_S = 10.0


class Side:
    """A signed end of a link, and the bare other end of it."""

    def __init__(self, clock, file=None):
        inside, self.outside = memory_pair()
        self.clock = clock
        self.told: list[Trouble] = []
        self.gate = Gate("udpin:127.0.0.1:14550", KEY, Times(clock, file), clock, self.told.append)
        self.link = SignedLink(inside, self.gate, clock)
        self.stranger = Encoder(1, 1)

    def now(self):
        return round((self.clock.unix_s() - EPOCH_UNIX_S) * STEPS_A_S)

    def arrives(self, time, key=KEY, link=0):
        """The bytes that pass of a frame signed so."""
        self.outside.write(signed(self.stranger.encode(BEAT), key.secret, link, time))
        return self.link.read(0.0)

    def arrives_unsigned(self):
        self.outside.write(self.stranger.encode(BEAT))
        return self.link.read(0.0)

    def waits(self, seconds):
        self.clock.advance_to(self.clock.boot_s() + seconds)
        self.link.read(0.0)


@pytest.fixture
def side(clock):
    return Side(clock)


def test_two_sides_with_one_key_hear_each_other_and_nothing_inside_is_signed(clock):
    a, b = memory_pair()
    vehicle, ground = (
        SignedLink(end, Gate("link", KEY, Times(clock), clock, lambda _: None), clock) for end in (a, b)
    )
    frames = [Encoder(1, 1).encode(BEAT), Encoder(1, 191).encode(BEAT)]
    vehicle.write(b"".join(frames))
    assert ground.read(0.0) == b"".join(frames)
    ground.write(frames[0])
    assert vehicle.read(0.0) == frames[0]


def test_all_that_goes_out_is_signed_each_at_a_later_time(side):
    encoder = Encoder(255, 190)
    for _ in range(40):
        side.link.write(encoder.encode(BEAT) * 2)
    framer = Framer()
    frames = [frame for _ in range(40) for frame in framer.feed(side.outside.read(0.0))]
    times = [int.from_bytes(frame.raw[-12:-6], "little") for frame in frames]
    assert len(frames) == 80
    assert all(is_signed(frame.raw) for frame in frames)
    assert times == sorted(set(times))


def test_a_long_write_goes_out_in_parts_that_fit_a_datagram(side):
    side.link.write(Encoder(1, 1).encode(BEAT) * 100)
    datagrams = [side.outside.read(0.0) for _ in range(3)]
    assert max(map(len, datagrams)) <= 1400
    assert sum(map(len, datagrams)) == 34 * 100


def test_each_kind_of_frame_that_is_refused_is_counted(side):
    now = side.now()
    assert side.arrives(now)
    assert side.arrives_unsigned() == b""
    assert side.arrives(now) == b""
    assert side.arrives(now - 1) == b""
    assert side.arrives(now + 1, new_key()) == b""
    assert side.arrives(now - 60 * 100_000 - 1, link=3) == b""
    assert side.arrives(now + 1)
    assert side.gate.counts == {
        Refusal.UNSIGNED: 1,
        Refusal.REPLAYED: 2,
        Refusal.OTHER_KEY: 1,
        Refusal.OLD: 1,
    }
    assert side.gate.words == "1 unsigned, 1 of another key, 2 replayed or late, 1 a minute old refused"


def test_a_frame_signed_sixty_seconds_ago_is_let_in_and_one_ten_microseconds_older_is_not(side):
    """Times are in steps of 10 us."""
    assert side.arrives(side.now() - 60 * 100_000, link=0)
    assert side.arrives(side.now() - 60 * 100_000 - 1, link=1) == b""
    assert side.gate.counts == {Refusal.OLD: 1}


def test_streams_of_two_links_have_times_of_their_own(side):
    now = side.now()
    assert side.arrives(now, link=0)
    assert side.arrives(now, link=1)


def test_a_frame_that_was_recorded_off_the_air_is_refused_whenever_it_comes_back(side):
    encoder = Encoder(1, 1)
    recorded = [signed(encoder.encode(BEAT), KEY.secret, 0, side.now() + n) for n in range(20)]
    for raw in recorded:
        side.outside.write(raw)
        assert side.link.read(0.0)
    for raw in recorded * 2:
        side.outside.write(raw)
        assert side.link.read(0.0) == b""
    assert side.gate.counts[Refusal.REPLAYED] == 40


def test_what_a_radio_says_of_itself_is_let_in_unsigned(side):
    raw = Encoder(51, 68).encode(dialect.MAVLink_radio_status_message(1, 2, 3, 4, 5, 6, 7))
    side.outside.write(raw)
    assert side.link.read(0.0) == raw


def test_a_flood_of_strangers_does_not_keep_the_vehicle_waiting(side):
    for _ in range(50):
        side.outside.write(side.stranger.encode(BEAT))
    assert side.arrives(side.now())


def test_where_nothing_is_let_in_the_crew_is_told_within_three_seconds_what_to_do(side):
    for _ in range(4):
        assert side.arrives_unsigned() == b""
        side.waits(0.7)
    assert [trouble.refusal for trouble in side.told] == [Refusal.UNSIGNED]
    assert side.told[0].sentence == (
        "udpin:127.0.0.1:14550: all that system 1, component 1, sends is refused, since it is not signed; "
        "give its side the same key with --sign-key if it is yours, and none to a stranger"
    )
    assert side.told[0].brief == "system 1/1 is refused: unsigned"


def test_a_component_that_is_refused_beside_one_that_signs_is_told_too(side):
    companion = Encoder(1, 191)
    for _ in range(5):
        side.outside.write(signed(companion.encode(BEAT), KEY.secret, 0, side.now()))
        assert side.link.read(0.0)
        assert side.arrives_unsigned() == b""
        side.waits(0.7)
    assert [report.sender for report in side.told] == [(1, 1)]


def test_a_single_order_that_was_refused_is_told_as_well(side):
    side.arrives(side.now(), new_key())
    side.waits(3.0)
    assert [trouble.refusal for trouble in side.told] == [Refusal.OTHER_KEY]


def test_it_is_told_again_each_half_minute_and_no_more_once_it_is_mended(side):
    for _ in range(65):
        side.arrives_unsigned()
        side.waits(1.0)
    assert len(side.told) == 3
    assert side.arrives(side.now())
    for _ in range(65):
        side.waits(1.0)
    assert len(side.told) == 3


def test_a_spoofed_frame_beside_the_true_ones_is_counted_and_troubles_nobody(side):
    for _ in range(20):
        side.arrives_unsigned()
        side.waits(0.5)
        assert side.arrives(side.now())
    assert side.told == []
    assert side.gate.counts == {Refusal.UNSIGNED: 20}


def flood(side, systems, key=None):
    """Frames of made-up systems, signed with `key` if given."""
    for system in systems:
        raw = Encoder(system, 1).encode(BEAT)
        side.outside.write(signed(raw, key.secret, 0, side.now()) if key else raw)
    side.link.read(0.0)


MORE = (
    "udpin:127.0.0.1:14550: more senders are refused than are named; yours is among them where it is signed with "
    "another key; compare the fingerprints that `seatrial keys show FILE` tells on both sides"
)


def test_who_invents_systems_is_counted_and_drowns_nothing(side):
    flood(side, range(1, 256))
    for _ in range(8):
        side.waits(0.5)
    assert side.gate.counts == {Refusal.UNSIGNED: 255}
    assert [report.sender for report in side.told] == [*((system, 1) for system in range(1, 9)), None]
    assert side.told[-1].brief == "more systems are refused: unsigned"


def test_a_vehicle_of_another_key_is_named_whatever_unsigned_strangers_send(side):
    other = new_key()
    for _ in range(8):
        flood(side, range(10, 250))
        side.arrives(side.now(), other)
        side.waits(0.5)
    assert [report.sender for report in side.told if report.refusal is Refusal.OTHER_KEY] == [(1, 1)]
    assert len(side.told) == 10
    assert "system 1, component 1, sends is refused, since it is signed with another key" in side.gate.trouble


def test_a_vehicle_is_told_of_though_a_stranger_speaks_unsigned_under_its_name(side):
    other = new_key()
    for _ in range(8):
        side.arrives(side.now(), other)
        side.arrives_unsigned()
        side.waits(0.5)
    assert {report.refusal for report in side.told} == {Refusal.OTHER_KEY, Refusal.UNSIGNED}


def test_where_strangers_sign_with_rubbish_it_is_said_that_there_are_more_than_are_named(side):
    rubbish, other = new_key(), new_key()
    for _ in range(8):
        flood(side, range(10, 18), rubbish)
        side.arrives(side.now(), other)
        side.waits(0.5)
    assert [report.sender for report in side.told] == [*((system, 1) for system in range(10, 18)), None]
    assert side.told[-1].sentence == side.gate.trouble == MORE


def test_a_vehicle_whose_clock_stands_in_the_past_is_told_of_and_heals_once_it_hears_the_ground():
    ground, vehicle = Side(SimulatedClock()), Side(SimulatedClock(unix_at_boot_s=1_500_000_000.0))
    encoder = Encoder(1, 1)

    def speaks(sender, receiver, raw):
        sender.link.write(raw)
        receiver.outside.write(sender.outside.read(0.0))
        return receiver.link.read(0.0)

    assert speaks(vehicle, ground, encoder.encode(BEAT)) == b""
    ground.waits(3.0)
    assert [trouble.refusal for trouble in ground.told] == [Refusal.OLD]
    assert "set the clocks of both sides" in ground.told[0].sentence
    beat = Encoder(255, 190).encode(BEAT)
    assert speaks(ground, vehicle, beat) == beat
    again = encoder.encode(BEAT)
    assert speaks(vehicle, ground, again) == again


def test_times_go_on_over_a_restart_though_the_clock_was_set_back(tmp_path):
    file = tmp_path / "deep" / "times.json"
    before = Side(SimulatedClock(), file)
    assert before.arrives(before.now())
    last = before.gate.out(Encoder(1, 1).encode(BEAT))
    before.link.close()
    sent = int.from_bytes(last[-12:-6], "little")
    until(lambda: file.exists() and json.loads(file.read_text())["sent"] == sent, PATIENCE_S)
    after = Side(SimulatedClock(unix_at_boot_s=1_500_000_000.0), file)
    assert after.gate.out(Encoder(1, 1).encode(BEAT))[-12:-6][::-1] > last[-12:-6][::-1]
    assert after.arrives(before.now()) == b""
    assert after.gate.counts == {Refusal.REPLAYED: 1}
    assert after.arrives(before.now() + 1)


def test_a_process_that_was_killed_never_says_a_time_twice(tmp_path):
    file = tmp_path / "times.json"
    killed = Times(SimulatedClock(), file)
    times = [killed.next() for _ in range(1000)]
    until(file.exists, PATIENCE_S)
    assert Times(SimulatedClock(), file).next() > times[-1]


def test_rubbish_for_kept_times_is_no_hindrance(tmp_path):
    file = tmp_path / "times.json"
    for text in ("", "[", "[]", '{"sent": -1, "heard": {}}', '{"sent": 1, "heard": {"1 1": 2}}', "[" * 9999):
        file.write_text(text)
        assert Times(SimulatedClock(), file).next() > 0


def test_times_that_can_not_be_kept_stop_nothing(tmp_path):
    (tmp_path / "file").write_text("")
    times = Times(SimulatedClock(), tmp_path / "file" / "times.json")
    assert times.next() < times.next()


def test_a_disk_that_stalls_holds_up_no_frame(side, tmp_path, monkeypatch):
    stalled, written = Event(), Event()

    def stalls(*_):
        stalled.wait(PATIENCE_S)
        written.set()

    monkeypatch.setattr("bridge.signing.link.write_whole", stalls)
    times = Times(side.clock, tmp_path / "times.json")
    first = times.next()
    side.clock.advance_to(200.0)
    assert (times.next() > first, written.is_set()) == (True, False)
    stalled.set()
    assert written.wait(PATIENCE_S)


def test_what_can_not_be_signed_is_not_sent_but_counted(side):
    mav = dialect.MAVLink(None, srcSystem=255, srcComponent=190)
    side.link.write(bytes(BEAT.pack(mav, force_mavlink1=True)))
    assert side.outside.read(0.0) == b""
    assert side.link.dropped == 1


def test_closing_closes_the_link_inside(side):
    side.link.close()
    with pytest.raises(Exception, match="was closed"):
        side.outside.read(0.0)
