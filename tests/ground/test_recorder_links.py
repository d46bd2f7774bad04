"""The recorder and its links: one that is lost, one that opens slowly, and what goes out on all of them."""

import threading

from faked_ground import Disk, FakeLink, Ground, frames_of

from bridge.clock import SimulatedClock
from bridge.errors import LinkLost
from bridge.framing import Encoder, Framer
from gcs_plugin.peers import GROUND_STATION
from gcs_plugin.recording.recorder import Recorder


def test_it_is_silent_unless_asked_to_beat():
    silent, beating = Ground(), Ground(heartbeat=GROUND_STATION)
    for _ in range(35):
        silent.hear(b"")
        beating.hear(b"", after_s=0.1)
    assert silent.link.sent == []
    beats = Framer().feed(b"".join(beating.link.sent))
    assert [(b.system, b.component, b.message_id) for b in beats] == [(255, 190, 0)] * len(beats)
    assert len(beats) == 4


def test_a_lost_link_is_said_and_opened_again_while_the_other_goes_on():
    clock, disk, notices = SimulatedClock(), Disk(), []
    broken, other, again = FakeLink("broken"), FakeLink("other"), FakeLink("broken")
    attempts = []

    def reopen(name):
        assert name == "broken"
        attempts.append(clock.now_s)
        if len(attempts) < 3:
            raise LinkLost("still gone")
        return again

    recorder = Recorder([broken, other], disk.open, clock, lambda: 1 << 40, notices.append, reopen)
    broken.chunks.append(LinkLost("broken: unplugged; plug it in"))
    raws = frames_of(200)
    for raw in raws:
        clock.advance_to(clock.now_s + 0.5)
        other.chunks.append(raw)
        recorder.step(0.0)
    again.chunks.append(frames_of(1, system=9)[0])
    recorder.step(0.0)
    assert broken.closed
    assert [notice.sentence for notice in notices] == ["broken: unplugged; plug it in", "broken is back"]
    assert len(disk.stored()) == 201
    assert len(attempts) == 3


def test_a_link_that_takes_its_time_to_open_holds_up_no_other():
    clock, disk = SimulatedClock(), Disk()
    broken, other, again = FakeLink("broken"), FakeLink("other"), FakeLink("broken")
    answered = threading.Event()

    def reopen(_):
        assert answered.wait(10.0)
        return again

    recorder = Recorder([broken, other], disk.open, clock, lambda: 1 << 40, lambda _: None, reopen)
    broken.chunks.append(LinkLost("broken: unplugged; plug it in"))
    for number, raw in enumerate(frames_of(50), start=1):
        clock.advance_to(clock.now_s + 0.1)
        other.chunks.append(raw)
        recorder.step(0.0)
        assert len(disk.stored()) == number
    assert not answered.is_set()
    answered.set()
    again.chunks.append(frames_of(1, system=9)[0])
    for _ in range(500):
        clock.advance_to(clock.now_s + 1.0)
        if recorder.step(0.0):
            break
    assert len(disk.stored()) == 51


class FakeOutlet:
    """Keeps what it is given; gives what is in `orders`."""

    def __init__(self):
        self.given = b""
        self.orders = []

    def broadcast(self, raw):
        self.given += raw

    def taken(self):
        orders, self.orders = self.orders, []
        return orders


def test_the_outlet_gets_every_frame_of_every_link_as_it_came():
    outlet = FakeOutlet()
    ground = Ground(outlet=outlet)
    sent = frames_of(20)
    for byte in b"".join(sent):
        ground.hear(bytes([byte]))
    assert outlet.given == b"".join(sent)


def test_what_the_outlet_sends_goes_out_on_every_link_and_into_the_recording():
    clock, disk, outlet = SimulatedClock(), Disk(), FakeOutlet()
    links = [FakeLink("one"), FakeLink("other")]
    recorder = Recorder(links, disk.open, clock, disk.space, lambda _: None, outlet=outlet)
    heard, orders = frames_of(2), frames_of(3, system=255)
    links[0].chunks.append(heard[0])
    outlet.orders = list(orders)
    recorder.step(0.0)
    links[1].chunks.append(heard[1])
    recorder.step(0.0)
    assert [link.sent for link in links] == [orders, orders]
    assert [raw for _, raw in disk.stored()] == [heard[0], *orders, heard[1]]
    assert outlet.given == b"".join(heard)
    assert (recorder.heard, recorder.recorded) == (2, 5)
    assert [source.system for source in recorder.receptions["one"]] == [1]


def test_an_order_goes_out_though_the_disk_is_full_and_one_link_is_gone():
    clock, disk, outlet = SimulatedClock(), Disk(), FakeOutlet()
    disk.full, disk.free = True, 0
    gone, good = FakeLink("gone"), FakeLink("good")
    recorder = Recorder([gone, good], disk.open, clock, disk.space, lambda _: None, outlet=outlet)
    gone.chunks.append(LinkLost("gone: unplugged; plug it in"))
    outlet.orders = frames_of(1)
    recorder.step(0.0)
    assert good.sent == frames_of(1)
    disk.full, disk.free = False, 1 << 40
    clock.advance_to(20.0)
    recorder.step(0.0)
    assert [raw for _, raw in disk.stored()] == frames_of(1)


def test_a_crowd_of_made_up_addresses_is_warned_of_once():
    ground = Ground()
    for component in range(256 + 2):
        ground.hear(Encoder(1 + component // 200, component % 200 + 1).frame(0, bytes(9)))
    ground.hear(b"", after_s=2.0)
    ground.hear(b"", after_s=2.0)
    (said,) = ground.sentences()
    assert "somebody makes up addresses; all is recorded" in said
