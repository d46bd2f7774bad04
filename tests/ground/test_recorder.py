"""The recorder: every frame in a file, whatever its links do, and the silences of a vehicle."""

import threading

import pytest
from faked_ground import Ground, frames_of
from fakes.vehicle import FakeLink
from pymavlink.dialects.v20 import ardupilotmega as mav

from bridge.clock import SimulatedClock
from bridge.errors import LinkLost
from bridge.wire.framing import Encoder, Framer
from gcs_plugin.peers import GROUND_STATION, Peers
from gcs_plugin.recording.silence import SilenceTracker


def test_a_frame_of_an_unknown_id_is_recorded_raw():
    ground = Ground()
    unknown = bytes([0xFD, 3, 0, 0, 7, 1, 1, 0x11, 0x22, 0x05, 1, 2, 3, 0xAA, 0xBB])
    known = frames_of(1)[0]
    ground.hear(known + unknown + known)
    assert ground.disk.raws[:2] == [known, unknown]
    (reception,) = ground.recorder.receptions["fake:"]
    assert (reception.system, reception.component) == (1, 1)


class JumpingClock(SimulatedClock):
    """Its Unix time can be set by hand, as by a time server."""

    jump_s = 0.0

    def unix_s(self):
        return super().unix_s() + self.jump_s


@pytest.mark.parametrize("jump_s", [-86400.0, 86400.0])
def test_stamps_stay_even_when_the_wall_clock_is_set(jump_s):
    ground = Ground(clock=JumpingClock())
    start_us = ground.recorder.unix_us()
    for number, raw in enumerate(frames_of(10), start=1):
        ground.clock.jump_s = jump_s if number > 5 else 0.0
        ground.hear(raw, after_s=0.1)
    assert [stamp - start_us for stamp, _ in ground.disk.stored()] == [n * 100_000 for n in range(1, 11)]


@pytest.mark.parametrize("apart_s", [0.0, 500.0])
def test_two_vehicles_under_one_id_on_a_link_each_are_said_once_to_mix_in_the_recording(apart_s):
    ground, encoders = Ground(links=("a", "b")), [Encoder(1, 1), Encoder(1, 1)]
    for second in range(1, 31):
        clocks = (
            mav.MAVLink_system_time_message(0, round(1000 * since_s))
            for since_s in (second, apart_s + second)
        )
        ground.hear(*map(Encoder.encode, encoders, clocks), after_s=1.0)
    mixed = [
        "a and b: two vehicles beat as system 1, component 1, and both would obey; stop one, or give one another id "
        "(system_id in its vehicle file); their messages are mixed in this recording, and tell of neither"
    ]
    assert ground.sentences() == (mixed if apart_s else [])


def test_it_is_silent_unless_asked_to_beat():
    silent, beating = Ground(), Ground(heartbeat=GROUND_STATION)
    for _ in range(35):
        silent.hear(b"")
        beating.hear(b"", after_s=0.1)
    assert silent.link.sent == []
    beats = Framer().feed(b"".join(beating.link.sent))
    assert [(b.system, b.component, b.message_id) for b in beats] == [(255, 190, 0)] * len(beats)
    assert len(beats) == 4


def test_what_came_whole_before_a_link_was_lost_is_recorded_though_a_broken_start_held_it_back():
    ground, sent = Ground(), frames_of(3)
    broken = bytes((sent[0][0], 250)) + sent[0][2:]
    ground.hear(broken + b"".join(sent[1:]))
    assert ground.disk.stored() == []
    ground.hear(LinkLost("fake: unplugged; plug it in"))
    ground.hear(b"")
    assert ground.disk.raws == sent[1:]


UNPLUGGED = LinkLost("broken: unplugged; plug it in")


def test_a_lost_link_is_said_and_opened_again_while_the_other_goes_on():
    again, attempts = FakeLink("broken"), []

    def reopen(name):
        attempts.append(name)
        if len(attempts) < 3:
            raise LinkLost("still gone")
        return again

    ground = Ground(links=("broken", "other"), reopen=reopen)
    ground.hear(UNPLUGGED)
    for raw in frames_of(200):
        ground.hear(b"", raw, after_s=0.5)
    again.chunks.append(frames_of(1, system=9)[0])
    ground.hear()
    assert ground.link.closed
    assert ground.sentences() == ["broken: unplugged; plug it in", "broken is back"]
    assert len(ground.disk.stored()) == 201
    assert attempts == ["broken"] * 3


def test_a_link_that_takes_its_time_to_open_holds_up_no_other():
    again, answered = FakeLink("broken"), threading.Event()

    def reopen(_):
        assert answered.wait(60.0)
        return again

    ground = Ground(links=("broken", "other"), reopen=reopen)
    ground.hear(UNPLUGGED)
    for number, raw in enumerate(frames_of(50), start=1):
        ground.hear(b"", raw, after_s=0.1)
        assert len(ground.disk.stored()) == number
    assert not answered.is_set()
    answered.set()
    again.chunks.append(frames_of(1, system=9)[0])
    assert any(ground.hear(after_s=1.0) for _ in range(500))
    assert len(ground.disk.stored()) == 51


class FakeOutlet:
    """Keeps the bytes that it is given; gives the frames in `orders`."""

    def __init__(self):
        self.given = b""
        self.orders = []

    def broadcast(self, raw):
        self.given += raw

    def taken(self):
        orders, self.orders = self.orders, []
        return orders


def test_what_the_outlet_sends_goes_out_on_every_link_and_into_the_recording():
    outlet = FakeOutlet()
    ground = Ground(links=("one", "other"), outlet=outlet)
    heard, orders = frames_of(2), frames_of(3, system=255)
    outlet.orders = list(orders)
    ground.hear(heard[0])
    ground.hear(b"", heard[1])
    assert [link.sent for link in ground.links] == [orders, orders]
    assert ground.disk.raws == [heard[0], *orders, heard[1]]
    assert outlet.given == b"".join(heard)
    assert (ground.recorder.heard, ground.recorder.kept.frames) == (2, 5)
    assert [source.system for source in ground.recorder.receptions["one"]] == [1]


def test_an_order_goes_out_though_the_disk_is_full_and_one_link_is_gone():
    outlet = FakeOutlet()
    ground = Ground(links=("broken", "good"), outlet=outlet)
    ground.disk.full, ground.disk.free = True, 0
    outlet.orders = frames_of(1)
    ground.hear(UNPLUGGED)
    assert ground.links[1].sent == frames_of(1)
    ground.disk.full, ground.disk.free = False, 1 << 40
    ground.hear(after_s=20.0)
    assert ground.disk.raws == frames_of(1)


def test_a_crowd_of_made_up_addresses_is_warned_of_once():
    ground = Ground()
    for component in range(256 + 2):
        ground.hear(Encoder(1 + component // 200, component % 200 + 1).frame(0, bytes(9)))
    ground.hear(b"", after_s=2.0)
    ground.hear(b"", after_s=2.0)
    (said,) = ground.sentences()
    assert "somebody makes up addresses; all is recorded" in said


class Vehicle:
    """Sends four frames a second, once a second its boot time; `speaks` where the ground hears it."""

    def __init__(self, ring=False, system=1):
        self.encoder, self.ring, self.tick = Encoder(system, 1), ring, 0

    def quarter(self):
        """Its frame of a quarter of a second."""
        boot_ms, kind = 250 * self.tick, self.tick % 4
        self.tick += 1
        if kind == 0:
            return self.encoder.encode(mav.MAVLink_heartbeat_message(12, 3, 0, 0, 4, 3))
        if kind == 1:
            return self.encoder.encode(mav.MAVLink_system_time_message(0, boot_ms))
        if kind == 2 and self.ring:
            return self.encoder.encode(mav.MAVLink_named_value_int_message(boot_ms, b"BOOT_ID", 7))
        return self.encoder.encode(mav.MAVLink_attitude_message(boot_ms, 0, 0, 0, 0, 0, 0))


def listened(ground, vehicle, seconds, heard=True):
    for _ in range(4 * seconds):
        raw = vehicle.quarter()
        ground.hear(raw if heard else b"", after_s=0.25)


@pytest.mark.parametrize("ring", [True, False])
def test_a_recording_tells_for_how_long_the_vehicle_was_not_heard_and_whether_it_keeps_its_own(ring):
    ground, vehicle = Ground(), Vehicle(ring)
    listened(ground, vehicle, 20)
    listened(ground, vehicle, 7, heard=False)
    listened(ground, vehicle, 20)
    listened(ground, vehicle, 58, heard=False)
    listened(ground, vehicle, 20)
    count = ground.recorder.count
    assert (count.unheard_s, count.keeps_ring) == (pytest.approx(58.25, abs=0.01), ring)


def test_a_vehicle_that_is_heard_all_along_or_no_more_at_the_end_has_no_silence():
    ground, vehicle = Ground(), Vehicle()
    listened(ground, vehicle, 60)
    listened(ground, vehicle, 60, heard=False)
    assert ground.recorder.count.unheard_s == 0.0


def test_a_vehicle_that_was_switched_off_for_a_while_has_no_silence():
    ground = Ground()
    listened(ground, Vehicle(), 60)
    listened(ground, Vehicle(), 60, heard=False)
    listened(ground, Vehicle(), 60)
    assert ground.recorder.count.unheard_s == 0.0


def heard_by(times_s, frame_at):
    peers, unheard = Peers(), SilenceTracker()
    for n, time_s in enumerate(times_s):
        for frame in Framer().feed(frame_at(n)):
            unheard.on_frame(peers.on_frame(frame, "udpin:1", time_s), frame, time_s)
    return unheard.longest_s


@pytest.mark.parametrize("every_s", [1.0, 6.0, 20.0])
def test_a_vehicle_on_deck_that_beats_slowly_alone_has_no_silence(every_s):
    encoder = Encoder(1, 1)
    beat = mav.MAVLink_heartbeat_message(12, 3, 0, 0, 4, 3)
    assert heard_by([every_s * n for n in range(60)], lambda _: encoder.encode(beat)) == 0.0


def test_frames_that_a_link_held_back_were_heard():
    vehicle = Vehicle()
    held = [60.0 + 1e-3 * n if 20 < 0.25 * n < 60 else 0.25 * n for n in range(400)]
    assert heard_by(held, lambda _: vehicle.quarter()) == 0.0


def test_a_ground_that_stood_still_did_not_hear_meanwhile():
    vehicle, sent = Vehicle(), []
    for _ in range(400):
        sent.append(vehicle.quarter())
    kept = [*range(160), *range(320, 400)]
    times_s = [0.25 * n if n < 160 else 0.25 * (n - 160) for n in kept]
    assert heard_by(times_s, lambda n: sent[kept[n]]) == pytest.approx(40.0)
