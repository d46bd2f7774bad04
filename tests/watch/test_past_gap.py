"""A dive that is watched from its middle on: the gap monitor goes on from what its recording holds."""

import threading
from dataclasses import replace

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav
from test_gap_monitor import RUVIFIST, THERE_AND_BACK, TRUTH, said
from vehicle_on_air import LINK, frame_of, heartbeat
from waiting import until

from bridge.simulator.direct import simulate_truth
from bridge.vehicle.coefficients import BY_NAME
from bridge.wire.framing import Encoder
from bridge.wire.readings import encode
from bridge.wire.tlog import TlogWriter, read_tlog
from gcs_plugin.monitor.gap import LEARNING_S
from gcs_plugin.watch import past_gap
from gcs_plugin.watch.past_gap import THREAD_NAME
from gcs_plugin.watch.picture import Kind
from gcs_plugin.watch.watcher import Watcher

WEAK_S, OPENED_S = 75.0, 100.0
"""When a thruster loses half of its thrust, and when the watch begins."""
HELD = {BY_NAME[name].parameter_id(0): value for name, value in TRUTH.model.items()}


@pytest.fixture(autouse=True)
def at_once(monkeypatch):
    monkeypatch.setattr(past_gap, "AFTER_S", 0.0)


@pytest.fixture(scope="module")
def frames():
    """(time, bytes) of all that the vehicle sends in a dive of 144 s."""
    truth = replace(TRUTH, onset={"T2_gain": 0.5}, onset_s=WEAK_S)
    encoder, out, now_s = Encoder(1, 1), [(0.0, Encoder(1, 1).encode(heartbeat(armed=True)))], 0.0
    for reading in said(simulate_truth(RUVIFIST, "survey", THERE_AND_BACK, seed=7, truth=truth)):
        now_s = now_s if reading.signal == "alive" else reading.time_s
        out.append((now_s, encoder.frame(*encode(reading))))
    return out


def recording_of(path, frames):
    with TlogWriter(path) as writer:
        for time_s, raw in frames:
            writer.write(1_790_000_000_000_000 + round(time_s * 1e6), raw)
    return path


def watched(frames, recordings, *meanwhile):
    """The picture at the end of a dive that is watched from OPENED_S on, while its recording is read at first."""
    watcher = Watcher(RUVIFIST, accepted=lambda _: HELD, recorded=lambda: recordings)
    for raw in (frames[0][1], *meanwhile):
        watcher.feed(frame_of(raw), OPENED_S, LINK)
    until(lambda: THREAD_NAME not in {thread.name for thread in threading.enumerate()})
    watcher.picture(OPENED_S)
    for time_s, raw in ((OPENED_S, frames[1][1]), *(frame for frame in frames if frame[0] > OPENED_S)):
        watcher.feed(frame_of(raw), time_s, LINK)
    return watcher.picture(frames[-1][0])


@pytest.fixture
def recording(frames, tmp_path):
    """Of all until shortly before the watch began: what was not written yet is a hole."""
    before = [frame for frame in frames if frame[0] <= OPENED_S - 2.0]
    return recording_of(tmp_path / "telemetry.tlog", before)


def test_what_departed_before_the_watch_began_is_found_where_the_dive_is_recorded(frames, recording):
    gap = watched(frames, [recording]).gap
    assert gap.since_s is not None
    assert gap.causes[0].words.startswith("thruster 2 gives ")


def test_a_model_that_came_into_force_while_the_recording_was_read_is_the_one_that_holds(frames, recording):
    other = mav.MAVLink_param_value_message(b"FF0_D_U", 50.0, 9, 1, 0)
    gap = watched(frames, [recording], Encoder(1, 1).encode(other)).gap
    assert gap.learns_s > 0  # the floor of another model is another one


def test_all_that_is_heard_while_the_recording_is_read_follows_it(frames, recording, monkeypatch):
    """A recording of hours is read for minutes: a hole of that length would take an alarm back."""
    may_read = threading.Event()

    def read(path):
        records = list(read_tlog(path))
        assert may_read.wait(60.0)
        return iter(records)

    monkeypatch.setattr(past_gap, "read_tlog", read)
    watcher = Watcher(RUVIFIST, accepted=lambda _: HELD, recorded=lambda: [recording])
    heard = [(OPENED_S, frames[0][1]), *(frame for frame in frames if frame[0] > OPENED_S - 2.0)]
    for time_s, raw in heard:
        watcher.feed(frame_of(raw), max(time_s, OPENED_S), LINK)
    assert watcher.picture(frames[-1][0]).gap.since_s is None
    may_read.set()
    until(lambda: THREAD_NAME not in {thread.name for thread in threading.enumerate()})
    gap = watcher.picture(frames[-1][0]).gap
    assert gap.since_s is not None
    assert gap.causes[0].words.startswith("thruster 2 gives ")


def test_a_watch_that_is_closed_reads_no_further(recording, monkeypatch):
    monkeypatch.setattr(past_gap, "AFTER_S", 3600.0)
    watcher = Watcher(RUVIFIST, system=1, accepted=lambda _: HELD, recorded=lambda: [recording])
    assert THREAD_NAME in {thread.name for thread in threading.enumerate()}
    watcher.close()
    until(lambda: THREAD_NAME not in {thread.name for thread in threading.enumerate()})


@pytest.mark.parametrize("names", [(), ("missing.tlog",)], ids=["not recorded", "not readable"])
def test_without_a_recording_the_floor_is_learnt_from_the_first_second_of_the_watch_on(
    frames, tmp_path, names
):
    gap = watched(frames, [tmp_path / name for name in names]).gap
    assert 0 < gap.learns_s < LEARNING_S - 30


def test_a_watch_that_turns_to_another_vehicle_reads_that_ones_dive(frames, recording):
    watcher = Watcher(RUVIFIST, accepted=lambda _: HELD, recorded=lambda: [recording])
    watcher.feed(frame_of(Encoder(9, 1).encode(heartbeat())), 0.0, LINK)
    watcher.feed(frame_of(frames[0][1]), OPENED_S, LINK)
    assert until(lambda: watcher.picture(OPENED_S).gap).axes


def test_a_bridge_that_falls_silent_beside_an_autopilot_that_beats_on_leaves_the_gap_unknown(frames):
    watcher = Watcher(RUVIFIST, accepted=lambda _: HELD)
    for time_s, raw in frames:
        watcher.feed(frame_of(raw), time_s, LINK)
    end_s, autopilot = frames[-1][0], Encoder(1, 1)
    assert watcher.picture(end_s).gap.axes
    for second in range(1, 21):
        watcher.feed(frame_of(autopilot.encode(heartbeat(armed=True))), end_s + second, LINK)
    picture = watcher.picture(end_s + 20.0)
    assert picture.armed_age_s == 0.0
    assert picture.gap is None
    assert Kind.GAP not in {alarm.kind for alarm in picture.alarms}
