"""A fault of one link, device or reading spreads to nothing else."""

from dataclasses import replace

import numpy as np
import pytest
from fakes.vehicle import FakeLink
from pymavlink.dialects.v20 import ardupilotmega as dialect
from service_rig import acted, fog, vehicle

from bridge.clock import SimulatedClock
from bridge.errors import LinkLost
from bridge.links.link import Link
from bridge.links.reconnecting import Reconnecting
from bridge.onboard.link_set import Sides
from bridge.onboard.parameters import ParameterServer
from bridge.onboard.service import Bridge
from bridge.sensors.samples import DvlSample, PressureSample
from bridge.vehicle.config import Device
from bridge.vehicle.parameters import vehicle_table
from bridge.wire.framing import Framer


@pytest.mark.parametrize(("reads_fail", "writes_fail"), [(True, True), (True, False), (False, True)])
def test_one_link_that_fails_takes_nothing_from_the_others_and_is_told_once(rig, reads_fail, writes_fail):
    broken = FakeLink("serial:/dev/ttyX", reads_fail=reads_fail, writes_fail=writes_fail)
    bridge = Bridge(rig.vehicle, rig.clock, [broken, *rig.links], rig.parameters)
    texts = []
    for i in range(50):
        rig.clock.advance_to(0.05 * i)
        bridge.publish(acted(0.05 * i))
        bridge.step()
        texts += [m.text for m in rig.heard() if m.get_type() == "STATUSTEXT"]
        assert len(rig.readings_of("tau_cmd")) == 1
    assert texts == ["link lost: serial:/dev/ttyX"]
    assert bridge.link_faults == {"serial:/dev/ttyX": "gone"}
    broken.reads_fail = broken.writes_fail = False
    bridge.publish(acted(3.0))
    bridge.step()
    assert bridge.link_faults == {}
    assert broken.sent


def test_a_link_that_mends_itself_is_told_lost_once_while_it_is_away(rig):
    plugged: list[FakeLink] = []

    def connect():
        if not plugged:
            raise LinkLost("there is no port")
        return plugged[0]

    link = Reconnecting(connect, rig.clock, "serial:/dev/ttyX")
    bridge = Bridge(rig.vehicle, rig.clock, [link, *rig.links], rig.parameters)
    texts = []
    for i in range(40):
        rig.clock.advance_to(0.05 * i)
        bridge.step()
        texts += [m.text for m in rig.heard() if m.get_type() == "STATUSTEXT"]
    assert texts == ["link lost: serial:/dev/ttyX"]
    assert bridge.link_faults == {"serial:/dev/ttyX": "there is no port"}
    plugged.append(FakeLink("serial:/dev/ttyX"))
    dropped = link.dropped
    assert dropped > 0
    rig.clock.advance_to(5.0)
    bridge.step()
    assert bridge.link_faults == {}
    assert plugged[0].sent
    rig.heard()
    rig.clock.advance_to(5.05)
    bridge.step()
    said = "".join(m.text for m in rig.heard() if m.get_type() == "STATUSTEXT")
    assert said == f"link back: serial:/dev/ttyX, {dropped} writes lost"


def test_a_port_that_opens_without_a_network_and_carries_nothing_is_told_lost_once_and_not_back(rig):
    unreachable = FakeLink("udpout:far:1", writes_fail=True)
    link = Reconnecting(lambda: unreachable, rig.clock, "udpout:far:1")
    bridge = Bridge(rig.vehicle, rig.clock, [link, *rig.links], rig.parameters)
    texts = []
    for i in range(2000):
        rig.clock.advance_to(0.005 * i)
        bridge.step()
        texts += [m.text for m in rig.heard() if m.get_type() == "STATUSTEXT"]
    assert [text for text in texts if "link" in text] == ["link lost: udpout:far:1"]
    assert bridge.link_faults


def test_a_link_that_does_not_carry_all_is_told_every_ten_seconds_with_what_it_lost(rig):
    slow = FakeLink("serial:/dev/ttyX")
    bridge = Bridge(rig.vehicle, rig.clock, [slow, *rig.links], rig.parameters)
    texts = []
    for i in range(300):
        slow.dropped += i < 240
        rig.clock.advance_to(0.05 * i)
        bridge.step()
        texts += [m.text for m in rig.heard() if m.get_type() == "STATUSTEXT"]
    assert [text for text in texts if "link" in text] == [
        "link too slow: serial:/dev/ttyX, 1 writes lost",
        "link too slow: serial:/dev/ttyX, 200 writes lost",
    ]
    assert bridge.link_faults == {}


def test_a_port_that_is_lost_after_it_was_read_does_not_count_as_never_read(rig):
    rig.bridge.port_fault("imu", "there is no port")
    assert rig.bridge.unread_ports == {"imu"}
    rig.bridge.port_fault("imu", "")
    rig.bridge.receive("imu", b"noise", 1.0)
    rig.bridge.port_fault("imu", "the other side has gone")
    assert rig.bridge.device_faults == {}
    rig.bridge.step()
    assert rig.bridge.device_faults["imu"] == "imu: the other side has gone"
    assert rig.bridge.unread_ports == frozenset()


def test_a_silent_device_one_that_makes_no_sense_and_one_that_is_back_are_named(rig):
    texts: list[str] = []
    for i in range(1, 100):
        now_s = 0.1 * i
        rig.clock.advance_to(now_s)
        rig.bridge.accept("depth", [PressureSample(now_s, 1e5, 12.0)])
        rig.bridge.receive("imu", b"\x55" * 20, now_s)
        if now_s > 6.0:
            rig.bridge.accept("fog", [fog(now_s, [0.0] * 100)])
        texts += [m.text for m in rig.step() if m.get_type() == "STATUSTEXT"]
        if i == 50:
            silent = sorted(texts)
    expected = ["dvl silent: check cable", "esc silent: check cable", "fog silent: check cable"]
    assert silent == [*expected, "imu makes no sense: check its baud"]
    assert texts[4:] == ["fog is back"]


def test_a_gyro_of_which_no_rate_is_valid_is_told_of_and_is_back_with_the_first_valid_one(rig):
    texts: list[str] = []
    for i in range(1, 100):
        now_s = 0.1 * i
        rig.clock.advance_to(now_s)
        block = fog(now_s, [0.0] * 100)
        valid = np.zeros(100, bool)
        valid[-1] = i == 99
        rig.bridge.receive("fog", b"", now_s)
        rig.bridge.accept("fog", [replace(block, valid=valid)])
        texts += [m.text for m in rig.step() if m.get_type() == "STATUSTEXT" and "fog" in m.text]
    assert texts == ["fog makes no sense: check its baud", "fog is back"]


def test_a_device_on_the_network_that_makes_no_sense_is_named_by_its_address_not_by_a_baud():
    craft = vehicle(dvl=Device("a50", port="tcp:192.168.194.95:16171"))
    clock = SimulatedClock()
    bridge = Bridge(craft, clock, [], ParameterServer(None, vehicle_table(craft)))
    for i in range(1, 50):
        clock.advance_to(0.1 * i)
        bridge.receive("dvl", b"HTTP/1.1 400 Bad Request\r\n", clock.now_s)
        bridge.step()
    said = "dvl makes no sense: check that tcp:192.168.194.95:16171 is its a50"
    assert bridge.device_faults == {"dvl": said}


def test_a_device_without_a_port_is_not_called_silent_and_is_back_when_it_speaks(rig):
    slots = ("imu", "fog", "depth", "esc")
    texts: list[str] = []
    faults = []
    for i in range(100):
        now_s = 0.125 * i
        rig.clock.advance_to(now_s)
        for slot in slots:
            rig.bridge.accept(slot, [PressureSample(now_s, 1e5, 12.0)])
        if i == 0:
            rig.bridge.port_fault("dvl", "there is no port /dev/ttyDVL; check the cable")
        if i == 45:
            rig.bridge.port_fault("dvl", "")
        if i == 90:
            rig.bridge.accept("dvl", [DvlSample(now_s, (0.0, 0.0, 0.0), 0.01, 2.0)])
        texts += [m.text for m in rig.step() if m.get_type() == "STATUSTEXT"]
        faults.append(rig.bridge.device_faults.get("dvl", ""))
    no_port = "dvl: there is no port /dev/ttyDVL; check the cable"
    assert texts == [no_port, "dvl silent: check cable", "dvl is back"]
    assert faults == [no_port] * 70 + ["dvl silent: check cable"] * 20 + [""] * 10


def test_long_words_go_out_in_pieces_that_belong_together(rig):
    rig.step(0.0)
    rig.bridge.say("x" * 120)
    pieces = rig.step()
    assert [len(m.text) for m in pieces] == [50, 50, 20]
    assert [m.chunk_seq for m in pieces] == [0, 1, 2]
    assert len({m.id for m in pieces}) == 1
    assert pieces[0].id != 0


def test_a_value_that_fits_no_message_is_counted_and_the_rest_goes_out(rig):
    rig.bridge.publish(replace(acted(0.1), tau_pid=(1e300,) * 6))
    rig.step(0.1)
    assert rig.bridge.counts["unfit"] == 1
    assert rig.readings_of("tau_cmd")


def test_writes_stay_small_enough_for_a_datagram_and_hold_whole_frames(rig):
    for i in range(40):
        rig.bridge.publish(acted(0.01 * i))
    rig.bridge.step()
    chunks = []
    while data := rig.ground.read(0.0):
        chunks.append(data)
    assert max(map(len, chunks)) <= 1200
    assert len(chunks) > 5
    framer = Framer()
    for chunk in chunks:
        assert sum(len(frame.raw) for frame in framer.feed(chunk)) == len(chunk)


def test_it_hears_a_flood_in_parts_and_still_does_its_work(rig):
    for _ in range(500):
        rig.ground.write(rig.encoder.encode(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)))
    rig.bridge.publish(acted(0.1))
    rig.step(0.1)
    assert rig.readings_of("tau_cmd")


class Flooding(Link):
    """A link with more to read for ever."""

    name = "flood"

    def __init__(self, piece):
        self._piece, self.reads = piece, 0

    def read(self, _):
        self.reads += 1
        return self._piece

    def write(self, data):
        pass

    def close(self):
        pass


def test_of_a_peer_that_floods_in_large_pieces_a_step_takes_one():
    link = Flooding(b"\x00" * 65536)
    sides = Sides([link], lambda _: None)
    assert list(sides.heard(0.0)) == []
    assert link.reads == 1
