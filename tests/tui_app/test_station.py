"""The engine: the newest picture, an off switch that does not give up, a recording that is looked for."""

from dataclasses import replace

import pytest
from fakes.vehicle import FakeLink
from made_view import recording
from pymavlink.dialects.v20 import ardupilotmega as mav
from waiting import until

from bridge.clock import SimulatedClock, SystemClock
from bridge.errors import LinkLost
from bridge.wire.framing import Encoder, Framer, decode
from gcs_plugin.peers import KnownVehicle, ground_heartbeat
from gcs_plugin.watch.watcher import Watcher
from tui.app.station import LinkSource, Station

HEARTBEAT = Framer().feed(Encoder(1, 1).encode(ground_heartbeat()))[0]
SUBMARINE = mav.MAVLink_heartbeat_message(mav.MAV_TYPE_SUBMARINE, 0, 0, 0, 4, 3)
VEHICLE_BEAT = Framer().feed(Encoder(1, 1).encode(SUBMARINE))[0]


class FakeSource:
    """Frames that a test puts in; keeps what is sent."""

    trouble, closed = "", False

    def __init__(self):
        self.coming, self.sent = [], []

    def frames(self):
        coming, self.coming = self.coming, []
        return coming

    def send(self, data):
        self.sent.append(data)

    def close(self):
        self.closed = True


class FakeSwitch:
    """Sends a heartbeat at every tick; done when a test says so."""

    def __init__(self, known=()):
        self.known, self.twins, self.done, self.waits_for = known, "", False, (1,)
        self.sent, self.heard, self.asked_again = 0, [], 0

    @property
    def words(self):
        return f"sent {self.sent} times"

    def tick(self, _):
        self.sent += not self.done
        return [] if self.done else [ground_heartbeat()]

    def again(self):
        self.asked_again += 1

    def on_frame(self, frame, now_s):
        self.heard.append((frame.message_id, now_s))


class Rig:
    """A station in simulated time; `hear` puts in frames, `turn` lets it work once."""

    def __init__(self):
        self.clock, self.source, self.switches = SimulatedClock(100.0), FakeSource(), []
        self.watcher, self.recording, self.looked = Watcher(None), None, 0
        self.station = Station(
            self.source, self.watcher, self.clock, self._look, self._make_switch, period_s=0.25
        )

    def _look(self, _):
        self.looked += 1
        return self.recording

    def _make_switch(self, known):
        self.switches.append(FakeSwitch(known))
        return self.switches[-1]

    def hear(self, *frames):
        self.source.coming = [(self.clock.now_s, "link", frame) for frame in frames]

    def turn(self, after_s=0.05):
        self.clock.advance_to(self.clock.now_s + after_s)
        self.station.turn()
        return self.station.view()


@pytest.fixture
def rig():
    return Rig()


def test_one_picture_is_made_a_period_however_many_frames_come_and_it_says_its_age(rig):
    times = []
    for _ in range(20):
        rig.hear(*[VEHICLE_BEAT] * 10)
        times.append(rig.turn().picture.now_s)
    assert len(set(times)) == 4
    (link,) = rig.station.view().picture.links
    assert (link.system, link.component) == (1, 1)
    rig.clock.advance_to(107.0)
    assert rig.station.view().behind_s == pytest.approx(107.0 - times[-1])


def test_the_recording_is_looked_for_once_a_second(rig):
    rig.recording = recording()
    for _ in range(40):
        rig.turn()
    assert rig.looked == pytest.approx(2, abs=1)
    assert rig.station.view().recording == rig.recording


def test_nothing_is_sent_before_the_switch_is_thrown_then_it_is_ticked_until_it_is_done_and_told_for_a_while(
    rig,
):
    for _ in range(10):
        assert rig.turn().forcing is None
    assert rig.source.sent == []
    rig.station.force_off()
    for _ in range(30):
        shown = rig.turn()
    assert (shown.forcing.words, shown.forcing.done) == ("sent 30 times", False)
    assert len(rig.source.sent) == 30
    (frame,) = Framer().feed(rig.source.sent[0])
    assert ((frame.system, frame.component), decode(frame).get_type()) == ((255, 190), "HEARTBEAT")
    rig.switches[0].done = True
    assert rig.turn().forcing.done
    assert rig.turn(after_s=9.0).forcing.done
    assert rig.turn(after_s=2.0).forcing is None
    assert len(rig.source.sent) == 30


def test_off_is_not_shown_as_acknowledged_once_the_vehicle_says_another_mode(rig, monkeypatch):
    mode, made = [1.0], rig.watcher.picture
    monkeypatch.setattr(rig.watcher, "picture", lambda now_s: replace(made(now_s), ff_mode=mode[0]))
    rig.station.force_off()
    rig.turn(after_s=0.3)
    rig.switches[0].done = True
    mode[0] = 0.0
    assert rig.turn(after_s=0.3).forcing.done
    assert rig.turn(after_s=0.3).forcing.done
    mode[0] = 1.0
    rig.turn(after_s=0.3)
    assert rig.turn().forcing is None


def test_a_switch_is_made_with_those_who_were_heard_before_the_key_and_hears_every_frame(rig):
    rig.hear(VEHICLE_BEAT)
    rig.turn()
    rig.station.force_off()
    rig.turn()
    (switch,) = rig.switches
    assert switch.known == (KnownVehicle((1, 1), False, 100.0),)
    rig.hear(HEARTBEAT)
    rig.turn()
    assert switch.heard == [(0, 100.1)]


def test_off_goes_by_the_link_that_heard_the_vehicle_though_another_is_connected_at_once(rig):
    rig.hear(VEHICLE_BEAT)
    rig.turn()
    other = FakeSource()
    rig.station.force_off()
    rig.station.change(other, Watcher(None))
    rig.turn()
    (switch,) = rig.switches
    assert [vehicle.source for vehicle in switch.known] == [(1, 1)]
    assert (len(rig.source.sent), len(other.sent)) == (1, 1)


def test_the_switch_is_told_of_twins(rig, monkeypatch):
    twins = replace(rig.watcher.picture(100.0), twins="two vehicles")
    monkeypatch.setattr(rig.watcher, "picture", lambda _: twins)
    rig.station.force_off()
    for _ in range(3):
        rig.turn(after_s=0.3)
    assert rig.switches[0].twins == "two vehicles"


def test_pressing_again_orders_off_once_more_and_begins_anew_only_where_it_was_done(rig):
    for _ in range(2):
        rig.station.force_off()
        rig.turn()
    (switch,) = rig.switches
    assert switch.asked_again == 1
    switch.done = True
    rig.turn()
    rig.station.force_off()
    rig.turn()
    assert len(rig.switches) == 2


def test_the_thread_reads_until_it_is_stopped_and_closes_the_link():
    source, watcher = FakeSource(), Watcher(None)
    source.coming = [(0.0, "link", VEHICLE_BEAT)]
    station = Station(source, watcher, SystemClock(), lambda _: None, FakeSwitch)
    station.start()
    until(lambda: watcher.picture(0.0).links)
    station.stop()
    assert source.closed


GONE = LinkLost("fake:1: gone")


def frames_until(source, clock, count, turns=500):
    frames = []
    for _ in range(turns):
        clock.advance_to(clock.now_s + 0.05)
        frames += source.frames()
        if len(frames) >= count:
            return frames
    return frames


def test_a_source_gives_frames_with_their_time_and_link_and_comes_back_when_it_was_lost():
    clock = SimulatedClock()
    raw = HEARTBEAT.raw
    links = [FakeLink("fake:1", [raw + raw[:4], raw[4:], GONE]), FakeLink("fake:1", [raw, GONE])]
    source = LinkSource(lambda: links.pop(0), "fake:1", clock)
    frames = frames_until(source, clock, 2)
    assert [(link, frame.message_id) for _, link, frame in frames] == [("fake:1", 0)] * 2
    assert frames_until(source, clock, 1)
    source.frames()
    assert "gone" in source.trouble
    source.close()


@pytest.mark.parametrize("silent", [False, True])
def test_a_source_sends_and_loses_what_is_sent_while_its_link_is_away_and_a_silent_one_sends_nothing(silent):
    clock = SimulatedClock()
    link = FakeLink("fake:1", [b"", b"", b"", GONE])
    source = LinkSource(lambda: link, "fake:1", clock, silent=silent)
    for _ in range(100):
        clock.advance_to(clock.now_s + 0.05)
        source.send(b"x")
        if link.sent:
            break
    assert (b"x" in link.sent) is not silent
    source.close()


def test_a_recording_begun_anew_leaves_no_lost_link_behind_and_the_age_told_is_its_own():
    clock, encoder = SimulatedClock(), Encoder(1, 1)
    beats = [encoder.encode(SUBMARINE) for _ in range(3)]
    hubs = [FakeLink(f"tcp:127.0.0.1:{port}", [beat, GONE]) for port, beat in enumerate(beats, 40001)]
    source, watcher = LinkSource(lambda: hubs.pop(0), "the recording", clock), Watcher(None)
    for _ in beats:
        for frame in frames_until(source, clock, 1):
            arrived_s = frame[0]
            watcher.feed(frame[2], arrived_s, frame[1])
        clock.advance_to(clock.now_s + 60.0)
        (row,) = watcher.picture(clock.now_s).links
        assert row.lost
        assert row.age_s == pytest.approx(clock.now_s - arrived_s)
        assert watcher.picture(arrived_s + 0.5).links[0].age_s == pytest.approx(0.5)
    source.close()
