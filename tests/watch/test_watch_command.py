"""`seatrial watch`: a line a second, exit codes, and a recording that ends and comes back."""

import io
import json
import math
import re
import subprocess
import sys
import threading
from dataclasses import replace

import pytest
from fakes.telling import telling
from fakes.vehicle import QuietLink
from pymavlink.dialects.v20 import ardupilotmega as mav
from rich.console import Console
from vehicle_on_air import LEVEL, NO_LOCK, STILL, OnAir, dvl, heartbeat, imu

from bridge import exit_codes
from bridge.clock import SimulatedClock, SystemClock
from bridge.errors import LinkLost
from bridge.vehicle.config import load_vehicle
from bridge.wire.framing import Encoder
from bridge.wire.readings import Reading, encode
from gcs_plugin.monitor.gap import AxisGap, Gap
from gcs_plugin.params.last_accepted import accepted_values
from gcs_plugin.recording.state import state_file, write_holding
from gcs_plugin.watch.picture import Alarm, Kind, Said
from gcs_plugin.watch.watcher import Watcher
from tui import cli, links, watch_text
from tui.app.screens import watch_lines
from tui.commands.watch import LinkReader, is_over

RUVIFIST = load_vehicle("ruvifist")
REFERENCE = (0.4, 0.1, 0.2, 0.01, 0.02, 0.03) + (0.0,) * 6 + (0.0, 1.5)
RECORDING = telling(frames=1234, bytes=5_600_000, disk_left_s=7200.0)


def said():
    """Signals and values of a healthy vehicle."""
    return [
        ("nu_ref", REFERENCE), ("imu", imu()), ("fog", (0.1,)), ("dvl", dvl()), ("altitude", (3.0,)),
        ("pressure", (110000.0, 20.0)), ("attitude", (*LEVEL, *STILL)), ("pwm", (1500.0,) * 8),
        ("rpm", (0.0,) * 58), ("battery", (15.9, 2.0)), ("gnss", (0.0, *(math.nan,) * 5, math.nan, 3.0)),
        ("ff_mode", (1.0,)), ("veh_cfg", (1.0,)),
    ]  # fmt: skip


@pytest.fixture
def healthy(watcher):
    vehicle = OnAir(watcher)
    vehicle.beats(1.0, armed=True)
    for signal, values in said():
        vehicle.tells(signal, values, 1.0)
    return watcher


class Played(QuietLink):
    """A link that gives a chunk a step, each a tenth of a second after the one before, and then stops its reader."""

    name = "played"

    def __init__(self, chunks, clock, stop):
        self.chunks, self.clock, self.stop = list(chunks), clock, stop

    def read(self, timeout_s):
        self.clock.advance_to(self.clock.boot_s() + timeout_s)
        if not self.chunks:
            self.stop.set()
            return b""
        return self.chunks.pop(0)

    def close(self):
        self.stop.set()


def test_a_line_holds_what_a_crew_asks_for(healthy):
    line = watch_text.line(healthy.picture(1.2), RECORDING)
    values = "u 0.30/0.40 v 0.00/0.10 w 0.00/0.20 r 5.7/1.7 deg/s"
    assert re.fullmatch(rf"ARMED \| REC \| FF shadow \| depth \d\.\d+/1\.50 m \| {values} \| 15\.9 V", line)


def test_troubles_stand_at_its_end_the_worst_first(healthy):
    vehicle = OnAir(healthy)
    vehicle.tells("battery", (13.0, 2.0), 1.1)
    vehicle.tells("dvl", NO_LOCK, 1.1)
    line = watch_text.line(healthy.picture(1.2), None)
    trouble = "DVL: no bottom lock for 0.2 s | battery: 13.0 V, and the thrust curve is …"
    assert line == f"ARMED | NOT RECORDING | FF shadow | {trouble}"


@pytest.mark.parametrize(("rows", "above"), [(24, True), (60, False)])
def test_what_is_wrong_stands_above_the_tables_where_a_terminal_has_no_room_for_all_of_them(
    healthy, rows, above
):
    vehicle = OnAir(healthy)
    vehicle.tells("battery", (13.0, 2.0), 1.1)
    vehicle.tells("dvl", NO_LOCK, 1.1)
    console = Console(width=120, height=rows, record=True, file=io.StringIO())
    console.print(watch_text.screen(healthy.picture(1.2), RECORDING, *console.size))
    lines = [line.strip() for line in console.export_text().splitlines()]
    first_table = next(number for number, line in enumerate(lines) if line.startswith("quantity"))
    assert ("DVL: no bottom lock for 0.2 s" in lines[:first_table]) is above
    assert any(line.startswith("battery: 13.0 V, and") for line in lines[:first_table]) is above


def test_a_line_is_never_longer_than_a_terminal_is_wide_and_loses_its_end(healthy):
    alarms = tuple(Alarm(Kind.GAP, "", f"{words} {'and so on ' * 6}") for words in ("one", "another"))
    picture = replace(healthy.picture(1.2), alarms=alarms, links=())
    line = watch_text.line(picture, None)
    assert line.startswith("ARMED | NO LINK | NOT RECORDING | ALARM one and so on ")
    assert len(line) == watch_text.LINE == 110
    assert line.endswith("…")


def test_a_line_has_no_values_of_a_vehicle_that_says_none(watcher):
    assert watch_text.line(watcher.picture(1.0), None) == "UNKNOWN | NO LINK | NOT RECORDING"


@pytest.mark.parametrize(("left_s", "words"), [(40 * 3600.0, "40 h left"), (1200.0, "20 min left")])
def test_what_is_left_of_a_disk_is_told_in_minutes_where_that_is_little(left_s, words):
    assert watch_text.recording_words(replace(RECORDING, disk_left_s=left_s)).endswith(f"  {words}")


def test_a_link_is_named_where_it_loses_frames(healthy):
    (row,) = healthy.picture(1.2).links
    assert watch_text.link_briefly(row) == ""
    assert watch_text.link_briefly(replace(row, loss=0.12)) == "loss 12%"
    assert watch_text.link_briefly(replace(row, lost=True, age_s=5.0)) == "LINK LOST 5 s"
    assert watch_text.link_briefly(replace(row, lost=True, age_s=math.inf)) == "LINK without HEARTBEAT"


GAP = Gap((AxisGap(0, 0.049, 0.005, True), AxisGap(5, 0.002, 0.003, False)), since_s=3.0)
ALARM = Alarm(Kind.GAP, "", "it departs from its model in surge: thruster 2 gives 41 % less")


def test_alarms_come_first_and_the_gap_stands_beside_its_floor(healthy):
    picture = replace(healthy.picture(1.2), gap=GAP, alarms=(ALARM,))
    line = watch_text.line(picture, RECORDING)
    assert line.startswith(f"ARMED | REC | ALARM {ALARM.words} | FF shadow")
    unled = {key: replace(trace, reference=None) for key, trace in picture.traces.items()}
    line = watch_text.line(replace(picture, alarms=(), traces=unled), RECORDING)
    assert line.endswith("r 5.7 deg/s | surge 49.0/5.0 mm/s off | 15.9 V")
    assert watch_text.header(picture, None)[1] == f"ALARM {ALARM.words}"
    assert watch_text.gap_table(picture).rows == [
        ("surge", "49.0", "5.0", "mm/s", "ALARM"),
        ("yaw", "0.11", "0.17", "deg/s", ""),
    ]
    plain = json.loads(json.dumps(watch_text.plain(picture)))
    assert plain["alarms"] == [{"kind": "model", "subject": "", "words": ALARM.words}]
    assert plain["gap"]["axes"][0]["drift"] == 0.049


def test_the_model_in_force_is_that_of_the_last_upload(healthy, tmp_path):
    assert watch_text.line(healthy.picture(1.2), RECORDING).count(" off") == 0
    asked = []
    watcher = Watcher(
        RUVIFIST, accepted=lambda system: asked.append(system) or {"FF1_M_U": 110.0, "FF1_D_U": 56.0}
    )
    OnAir(watcher).beats(1.0, armed=True)
    assert asked == [1]
    assert accepted_values(tmp_path, "ruvifist", 1) == {}


def test_a_stale_value_bears_its_age_and_one_that_is_gone_is_no_number(healthy):
    assert watch_text.now_of(healthy.picture(1.9).traces["u"]) == "0.30 (0.9 s old)"
    assert watch_text.now_of(healthy.picture(9.0).traces["u"]) == "--"


@pytest.mark.parametrize("at_s", [1.9, 9.0])
def test_the_reference_of_a_value_that_is_not_fresh_is_as_old_and_not_told_as_live(healthy, at_s):
    assert watch_text.asked_of(healthy.picture(1.2).traces["u"]) == "0.40"
    assert watch_text.asked_of(healthy.picture(at_s).traces["u"]) == ""


def test_the_gap_of_a_vehicle_whose_link_is_lost_is_not_told_as_live(healthy):
    picture = replace(healthy.picture(1.2), gap=GAP)
    lost = replace(picture, links=tuple(replace(row, lost=True, age_s=9.0) for row in picture.links))
    assert watch_text.gap_table(picture).rows
    assert watch_text.gap_table(lost).rows == []
    assert " off" not in watch_text.line(lost, RECORDING)


def test_the_mode_of_the_feed_forward_bears_its_age_as_plain_data_too(healthy):
    assert watch_text.plain(healthy.picture(9.0))["ff_mode_age_s"] > 7.0


def test_a_picture_is_made_every_second_and_once_more_at_the_end():
    clock, stop = SimulatedClock(), threading.Event()
    encoder = Encoder(1, 1)
    beats = [encoder.encode(heartbeat(armed=k > 4)) for k in range(35)]
    watcher, pictures = Watcher(None), []
    link = Played(beats, clock, stop)
    looked = LinkReader(link, watcher, clock)
    read = link.read

    def spied(timeout_s):
        if not pictures or looked.picture is not pictures[-1]:
            pictures.append(looked.picture)
        return read(timeout_s)

    link.read = spied
    looked.listen(stop)
    assert looked.frames == 35
    assert [round(picture.now_s - pictures[0].now_s) for picture in pictures] == [0, 1, 2, 3]
    assert looked.picture.armed.value == "ARMED"
    assert looked.picture.now_s > pictures[-1].now_s


@pytest.fixture
def on_link(monkeypatch):
    """Chunks that the link of `watch` will give, one a step; the verb ends after the last."""
    chunks, clock, stop = [], SimulatedClock(), threading.Event()
    monkeypatch.setattr("tui.links.link_for", lambda *_: Played(chunks, clock, stop))
    monkeypatch.setattr("tui.links.holding_now", lambda: None)
    monkeypatch.setattr("bridge.clock.SystemClock", lambda: clock)
    monkeypatch.setattr(
        "bridge.command_line.until_stopped", lambda work, _clock, _seconds, each: (work(stop), each(1.0))
    )
    return chunks


def test_once_prints_tables_writes_json_and_ends_with_1_where_a_sensor_is_bad(on_link, tmp_path, capsys):
    encoder = Encoder(1, 1)
    on_link.append(encoder.encode(heartbeat()))
    on_link.append(encoder.encode(mav.MAVLink_statustext_message(3, b"leak in the bow")))
    for signal, values in said():
        values = NO_LOCK if signal == "dvl" else values
        on_link.append(encoder.frame(*encode(Reading(signal, 1.0, values))))
    out = tmp_path / "picture.json"
    line = ["watch", "--link", "any", "--vehicle", "ruvifist", "--once", "--json", str(out)]
    assert cli.main(line) == exit_codes.NO
    shown = capsys.readouterr().out
    assert shown.startswith("DISARMED  FF shadow  hovering\n")
    assert "error: leak in the bow" in shown
    (row,) = [line for line in shown.splitlines() if line.startswith("DVL")]
    assert "bad" in row
    assert "no bottom lock for" in row
    data = json.loads(out.read_text(encoding="utf-8"))
    assert data["armed"] == "DISARMED"
    assert {sensor["signal"]: sensor["condition"] for sensor in data["sensors"]}["dvl"] == "bad"
    assert data["quantities"]["r"]["value"] == pytest.approx(0.1)


def test_in_a_pipe_each_picture_is_a_line_with_its_time(on_link, capsys):
    encoder = Encoder(1, 1)
    on_link.extend(encoder.encode(heartbeat(armed=True)) for _ in range(3))
    assert cli.main(["watch", "--link", "any"]) == exit_codes.DONE
    (line,) = capsys.readouterr().out.splitlines()
    assert re.match(r"\d\d:\d\d:\d\dZ ARMED \| NOT RECORDING$", line)


@pytest.mark.usefixtures("on_link")
def test_where_nothing_comes_it_says_so_and_ends_with_3(capsys):
    assert cli.main(["watch", "--link", "any"]) == exit_codes.LINK
    assert "nothing arrived on played" in capsys.readouterr().err


SPEC = "udpin:127.0.0.1:14550"
FIRST, SECOND = "tcp:127.0.0.1:40001", "tcp:127.0.0.1:40002"
HOLDING = telling(hub=FIRST, links=(SPEC,))


class Switched(QuietLink):
    """A link that beats at each read while it is `on`, is lost where it is not, and counts its reads."""

    def __init__(self, name, encoder):
        self.name, self._encoder, self.on, self.reads = name, encoder, True, 0

    def read(self, timeout_s):
        del timeout_s
        if not self.on:
            raise LinkLost(f"{self.name}: the other side has gone")
        self.reads += 1
        return self._encoder.encode(heartbeat())

    def close(self):
        self.on = False


class Ground:
    """This computer: a recording that runs or does not, the hubs that can be opened, and the vehicle's own port."""

    def __init__(self, monkeypatch):
        self.clock, encoder = SimulatedClock(), Encoder(1, 1)
        self.holding = HOLDING
        self.links = {name: Switched(name, encoder) for name in (FIRST, SECOND, SPEC)}
        self.opened = []
        monkeypatch.setattr(links, "holding_now", lambda: self.holding)
        monkeypatch.setattr("bridge.links.open.open_link", self.open)

    def open(self, name):
        self.opened.append(name)
        return self.links[name]

    def turn(self, link, turns=100):
        """The bytes of so many reads; 0.1 s each."""
        data = b""
        for _ in range(turns):
            data += link.read(0.01)
            self.clock.advance_to(self.clock.now_s + 0.1)
        return data


@pytest.fixture
def ground(monkeypatch):
    return Ground(monkeypatch)


@pytest.mark.parametrize("spec", [None, SPEC])
def test_it_waits_for_the_next_recording_and_leaves_the_vehicles_own_port_to_it(ground, spec):
    link = links.coming_back(links.link_for(spec), spec, ground.clock)
    assert ground.turn(link, 3)
    ground.holding, ground.links[FIRST].on = None, False
    assert not ground.turn(link)
    assert "start `seatrial record`" in link.fault
    ground.holding = replace(HOLDING, hub=SECOND)
    assert ground.turn(link)
    assert ground.opened == [FIRST, SECOND]
    link.close()


def test_the_next_recording_leaves_no_lost_link_behind(ground):
    link = links.coming_back(links.link_for(None), None, ground.clock)
    looked, stop = LinkReader(link, Watcher(None), ground.clock), threading.Event()
    read = link.read

    def scripted(timeout_s):
        now_s = ground.clock.now_s
        ground.clock.advance_to(now_s + timeout_s)
        if now_s > 5.0 and ground.holding.hub == FIRST:
            ground.links[FIRST].on, ground.holding = False, replace(HOLDING, hub=SECOND)
        if ground.links[SECOND].reads == 20:
            stop.set()
        return read(0.01)

    link.read = scripted
    looked.listen(stop)
    (row,) = looked.picture.links
    assert not row.lost
    assert row.age_s < 1.0
    assert looked.fault == ""
    link.close()


def test_the_alarms_end_with_a_recording_that_ends_in_order_and_not_with_one_that_hangs_or_was_killed(
    tmp_path, monkeypatch
):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    ended, now_s = subprocess.Popen([sys.executable, "-c", ""]), SystemClock().unix_s()
    ended.wait()
    for state in (telling(), telling(written_unix_s=now_s - 60.0), telling(pid=ended.pid)):
        write_holding(state)
        assert not is_over(state, now_s)
    state_file().unlink()
    assert is_over(state, now_s)


@pytest.mark.parametrize(("severity", "word"), [(-3, "emergency"), (3, "error"), (9, "debug")])
def test_a_severity_beyond_mavlinks_is_the_nearest_in_every_text(healthy, severity, word):
    said = (Said(0.0, severity, "leak"),)
    header = watch_text.header(replace(healthy.picture(1.2), said=said), None)
    assert f"{word}: leak" in header
    (line,) = watch_lines.words(said, 60)
    assert f"{word.upper():<10}" in [text for text, _ in line]
