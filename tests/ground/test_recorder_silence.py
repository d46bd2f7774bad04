"""What a recording says of a vehicle that it did not hear for a while."""

import pytest
from faked_ground import Ground
from pymavlink.dialects.v20 import ardupilotmega as mav

from bridge.framing import Encoder, Framer
from gcs_plugin.peers import Peers
from gcs_plugin.recording.silence import Heard, Unheard


class Vehicle:
    """Sends four frames a second, once a second its boot time; `speaks` where the ground hears it."""

    def __init__(self, ring=False, system=1):
        self.encoder, self.ring, self.tick = Encoder(system, 1), ring, 0

    def quarter(self):
        """What it sends in a quarter of a second."""
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


def frames_of(raw):
    return Framer().feed(raw)


def heard_by(times_s, frame_at):
    peers, unheard = Peers(), Unheard()
    for n, time_s in enumerate(times_s):
        for frame in frames_of(frame_at(n)):
            unheard.on_frame(peers.on_frame(frame, "udpin:1", time_s), frame, time_s)
    return unheard.heard


@pytest.mark.parametrize("every_s", [1.0, 6.0, 20.0])
def test_a_vehicle_on_deck_that_beats_slowly_alone_has_no_silence(every_s):
    encoder = Encoder(1, 1)
    beat = mav.MAVLink_heartbeat_message(12, 3, 0, 0, 4, 3)
    assert heard_by([every_s * n for n in range(60)], lambda _: encoder.encode(beat)) == Heard()


def test_a_ground_station_that_pauses_is_no_vehicle_that_was_not_heard():
    encoder = Encoder(255, 190)
    beat = mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
    raws = [encoder.encode(beat) for _ in range(80)]
    times_s = [*range(30), *range(90, 120)]
    assert heard_by(times_s, lambda n: raws[n if n < 30 else n + 20]) == Heard()


def test_frames_that_a_link_held_back_were_heard():
    vehicle = Vehicle()
    held = [60.0 + 1e-3 * n if 20 < 0.25 * n < 60 else 0.25 * n for n in range(400)]
    assert heard_by(held, lambda _: vehicle.quarter()) == Heard()


def test_a_ground_that_stood_still_did_not_hear_meanwhile():
    vehicle, sent = Vehicle(), []
    for _ in range(400):
        sent.append(vehicle.quarter())
    kept = [*range(160), *range(320, 400)]
    times_s = [0.25 * n if n < 160 else 0.25 * (n - 160) for n in kept]
    assert heard_by(times_s, lambda n: sent[kept[n]]).unheard_s == pytest.approx(40.0)
