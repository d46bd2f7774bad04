"""Alarms: limits from one file, judged from the picture, rung once each; a dive that ends is none."""

import math
from dataclasses import replace

import pytest
import yaml
from pymavlink.dialects.v20 import ardupilotmega as mav
from vehicle_on_air import LEVEL, NO_LOCK, STILL, OnAir, dvl, imu

from bridge import schema
from bridge.errors import ConfigError
from bridge.vehicle.config import CONFIGS, load_vehicle
from bridge.wire.status_codes import status_texts
from gcs_plugin.bell import Bell
from gcs_plugin.monitor.gap import AxisGap, Gap
from gcs_plugin.watch.alarms import SHIPPED, Alarms, AlarmTrace, Limits, Settings, load_settings, user_file
from gcs_plugin.watch.picture import Alarm, Kind
from gcs_plugin.watch.watcher import TEXTS_KEPT, Watcher
from tui.app.screens.watch_lines import unset_lines
from tui.watch_text import header

RUVIFIST = load_vehicle("ruvifist:survey")
SET = Settings(
    limits=Limits(battery_v=14.0, depth_m=10.0, altitude_m=0.5).over(SHIPPED.limits),
)
AHEAD = (1600.0,) * 4 + (1500.0,) * 4
TURNS = (1900.0,) * 4 + (0.0,) * 54


class Dive:
    """A healthy armed vehicle, second by second; what `changes` name is said in its place, None is left out."""

    def __init__(self, settings=SET):
        self.watcher = Watcher(RUVIFIST, settings=settings)
        self.vehicle = OnAir(self.watcher)
        self.now_s = 0.0

    def go_on(self, seconds, armed=True, beats=True, **changes):
        said = {
            "dvl": dvl(), "imu": imu(), "fog": (0.0,), "attitude": (*LEVEL, *STILL), "altitude": (3.0,),
            "pressure": (150_000.0, 15.0), "pwm": AHEAD, "rpm": TURNS, "battery": (15.8, 3.0),
        } | changes  # fmt: skip
        for _ in range(round(2 * seconds)):
            self.now_s += 0.5
            if beats:
                self.vehicle.beats(self.now_s, armed=armed)
            for signal, values in said.items():
                if values is not None:
                    self.vehicle.tells(signal, values, self.now_s)
        return self

    @property
    def alarms(self):
        return {alarm.kind: alarm.words for alarm in self.watcher.picture(self.now_s).alarms}

    def pictured(self, seconds, **changes):
        """Go on with a picture every half second, as the app does; the alarms in the end."""
        for _ in range(round(2 * seconds)):
            self.go_on(0.5, **changes)
            alarms = self.alarms
        return alarms


def test_a_healthy_dive_has_no_alarm():
    assert Dive().pictured(20.0) == {}


SILENT = dict.fromkeys(("dvl", "imu", "fog", "attitude", "altitude", "pressure", "pwm", "rpm", "battery"))


@pytest.mark.parametrize(
    ("changes", "kind", "words", "after_s"),
    [
        ({"battery": (13.8, 3.0)}, Kind.BATTERY, "battery 13.80 V, below 14 V", 5.0),
        ({"pressure": (101_325.0 + 110_000.0, 15.0)}, Kind.DEPTH, "depth 11.24 m, deeper than 10 m", 0.0),
        ({"altitude": (0.4,)}, Kind.ALTITUDE, "altitude 0.40 m, less than 0.5 m", 2.0),
        ({"rpm": (0.0, *TURNS[1:])}, Kind.THRUSTER, "thruster 1 stands still at 1600 us", 3.0),
        ({"dvl": NO_LOCK}, Kind.SENSOR, "DVL: no bottom lock for ", 5.0),
        ({"dvl": None}, Kind.SENSOR, "DVL: silent for ", 5.0),
        ({"beats": False, **SILENT}, Kind.LINK, "nothing heard of the vehicle for 6 s", 5.0),
    ],
)
def test_each_is_an_alarm_once_it_has_held_and_ends_with_it(changes, kind, words, after_s):
    dive = Dive().go_on(10.0)
    assert dive.pictured(max(after_s - 1.0, 0.5), **changes).get(kind) is None or after_s == 0.0
    alarms = dive.pictured(2.0, **changes)
    assert list(alarms) == [kind]
    assert alarms[kind].startswith(words)
    assert dive.pictured(2.0) == {}


@pytest.mark.parametrize(
    ("beyond", "lost", "kind", "words"),
    [
        (
            {"battery": (13.8, 3.0)},
            "battery",
            Kind.BATTERY,
            "battery 13.80 V, below 14 V; no reading since",
        ),
        (
            {"altitude": (0.4,)},
            "altitude",
            Kind.ALTITUDE,
            "altitude 0.40 m, less than 0.5 m; no reading since",
        ),
        (
            {"rpm": (0.0, *TURNS[1:])},
            "rpm",
            Kind.THRUSTER,
            "thruster 1 stands still at 1600 us; no reading since",
        ),
    ],
)
def test_an_alarm_holds_while_its_readings_are_lost_until_one_says_otherwise(beyond, lost, kind, words):
    dive = Dive().go_on(10.0)
    dive.pictured(8.0, **beyond)
    held = [dive.pictured(0.5, **{lost: None}).get(kind) for _ in range(16)]
    assert all(held)
    assert held[-1] == words
    assert kind not in dive.pictured(1.0)


def test_an_alarm_holds_beside_that_of_the_link_by_which_its_readings_are_lost():
    dive = Dive().go_on(10.0)
    low = {"battery": (13.8, 3.0)}
    dive.pictured(8.0, **low)
    held = [dive.pictured(0.5, beats=False, **SILENT).get(Kind.BATTERY) for _ in range(40)]
    assert all(held)
    assert Kind.LINK in dive.alarms
    assert dive.pictured(0.5, **low) == {Kind.BATTERY: "battery 13.80 V, below 14 V"}
    assert dive.pictured(1.0) == {}


DEPARTED = Gap((AxisGap(0, 0.02, 0.005, True),), since_s=30.0)


@pytest.mark.parametrize(
    ("lost", "kinds"),
    [({"gap": None}, [Kind.GAP]), ({"gap": DEPARTED, "armed_age_s": 8.0}, [Kind.LINK, Kind.GAP])],
)
def test_a_vehicle_that_departed_from_its_model_is_not_said_to_follow_it_while_no_reading_tells(lost, kinds):
    picture, alarms = replace(Dive().go_on(10.0).watcher.picture(10.0), lacks=""), Alarms(SET, RUVIFIST)
    seen = [
        alarms.look(replace(picture, now_s=now_s, **changes))
        for now_s, changes in ((10.0, {"gap": DEPARTED}), (12.0, {"gap": DEPARTED}), (30.0, lost))
    ]
    words = "it departs from its model in surge: no known cause fits"
    assert [alarm.words for alarm in seen[1]] == [words]
    assert [alarm.kind for alarm in seen[2]] == kinds
    assert seen[2][-1].words == f"{words}; no reading since"
    assert alarms.look(replace(picture, now_s=31.0, gap=Gap(DEPARTED.axes))) == ()
    assert alarms.look(replace(picture, now_s=32.0, gap=None)) == ()


def test_what_was_no_alarm_yet_becomes_none_while_its_readings_are_lost():
    dive = Dive().go_on(10.0)
    dive.pictured(1.0, battery=(13.8, 3.0))
    assert Kind.BATTERY not in dive.pictured(20.0, battery=None)
    assert Kind.BATTERY in dive.pictured(0.5, battery=(13.8, 3.0))


def test_a_sensor_that_says_nothing_of_use_and_then_nothing_at_all_is_an_alarm_throughout():
    dive = Dive().go_on(10.0)
    dive.pictured(8.0, dvl=NO_LOCK)
    assert all(dive.pictured(0.5, dvl=None).get(Kind.SENSOR) for _ in range(16))
    assert dive.pictured(1.0) == {}


def test_a_battery_alarm_ends_with_the_dive_of_a_disarmed_vehicle_that_is_switched_off():
    dive = Dive().go_on(10.0)
    assert Kind.BATTERY in dive.pictured(8.0, armed=False, battery=(13.8, 3.0))
    assert dive.pictured(8.0, beats=False, **SILENT) == {}


def test_a_limit_of_nought_switches_one_off():
    off = Settings(limits=Limits(**dict.fromkeys(vars(SHIPPED.limits), 0.0)))
    dive = Dive(off).go_on(10.0)
    assert dive.pictured(12.0, dvl=None, rpm=(0.0,) * 58, battery=(9.0, 1.0), altitude=(0.1,)) == {}


def test_a_dive_that_ends_is_no_alarm():
    dive = Dive().go_on(10.0).go_on(2.0, armed=False)
    assert dive.pictured(20.0, beats=False, **SILENT) == {}


@pytest.mark.parametrize("armed", [False, True])
def test_a_vehicle_that_was_away_and_is_back_may_take_its_time_with_its_sensors(armed):
    dive = Dive().go_on(10.0).go_on(2.0, armed=armed)
    dive.pictured(120.0, beats=False, **SILENT)
    assert dive.pictured(3.0, **SILENT) == {}
    assert dive.pictured(2.0) == {}
    dive.pictured(120.0, beats=False, **SILENT)
    assert Kind.SENSOR in dive.pictured(6.0, dvl=None)


def test_a_disarmed_vehicle_still_tells_of_its_battery_and_its_leak():
    dive = Dive().go_on(10.0).go_on(2.0, armed=False)
    dive.pictured(6.0, armed=False, battery=(13.0, 1.0))
    for message in status_texts("Leak Detected", mav.MAV_SEVERITY_CRITICAL, 1):
        dive.vehicle.says(message, dive.now_s)
    assert dive.pictured(0.5, armed=False, battery=(13.0, 1.0)) == {
        Kind.VEHICLE: "the vehicle says: Leak Detected",
        Kind.BATTERY: "battery 13.00 V, below 14 V",
    }
    assert dive.pictured(31.0, armed=False) == {}


def test_a_failsafe_is_an_alarm():
    dive = Dive().go_on(5.0)
    dive.vehicle.beats(dive.now_s, armed=True, status=mav.MAV_STATE_CRITICAL)
    assert dive.alarms == {Kind.VEHICLE: "the vehicle is in failsafe"}


def test_a_value_just_beyond_its_limit_does_not_read_as_the_limit_itself():
    density, surface_pa = (
        RUVIFIST.vehicle.water.weight_n_m3,
        100.0 * RUVIFIST.vehicle.water.surface_pressure_hpa,
    )
    deep = (surface_pa + 10.002 * density, 15.0)
    said = Dive().pictured(8, battery=(13.999, 3.0), pressure=deep)
    assert said[Kind.BATTERY] == "battery 13.99 V, below 14 V"
    assert said[Kind.DEPTH] == "depth 10.01 m, deeper than 10 m"


def test_thrusters_whose_speeds_came_last_at_rest_and_come_no_more_do_not_stand():
    dive = Dive()
    dive.pictured(5)
    dive.pictured(2, pwm=(1500.0,) * 8, rpm=(0.0,) * 58)
    assert dive.pictured(8, rpm=None).keys() == {Kind.SENSOR}
    assert all(math.isnan(row.rpm) for row in dive.watcher.picture(dive.now_s).thrusters)


def test_thrusters_that_never_tell_their_speed_do_not_stand():
    assert Dive().pictured(10.0, rpm=(0.0,) * 58) == {}


def test_the_shipped_file_says_what_holds_without_one():
    shipped = schema.build(Settings, yaml.safe_load((CONFIGS / "alarms.yaml").read_text("utf-8")), "shipped")
    assert shipped == SHIPPED


def test_the_crews_file_lies_over_the_shipped_one_and_a_vehicles_limits_over_both(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    assert load_settings() == SHIPPED
    file = tmp_path / "seatrial" / "alarms.yaml"
    file.parent.mkdir()
    file.write_text("limits: {depth_m: 20, link_s: 0}\nvehicles: {ruvifist: {depth_m: 10}}\n", "utf-8")
    settings = load_settings()
    assert settings.bell
    assert settings.of("ruvifist") == Limits(depth_m=10.0).over(settings.of("another"))
    assert (settings.of("another").depth_m, settings.of("another").link_s) == (20.0, 0.0)
    assert settings.of("another").sensor_s == SHIPPED.limits.sensor_s


@pytest.mark.parametrize(
    ("text", "words"),
    [("limits: {dept_m: 3}", "did you mean 'depth_m'"), ("limits: {depth_m: -3}", "depth_m is -3")],
)
def test_a_file_that_cannot_be_meant_is_refused(tmp_path, text, words):
    file = tmp_path / "alarms.yaml"
    file.write_text(text, "utf-8")
    with pytest.raises(ConfigError, match=words):
        load_settings(file)


BATTERY, LINK = Alarm(Kind.BATTERY, "", "13.9 V"), Alarm(Kind.LINK, "", "6 s")


def test_the_bell_rings_once_for_each_alarm_and_again_when_it_comes_back_after_a_while():
    rung = []
    bell = Bell(SHIPPED, lambda: rung.append("bell"))
    assert bell.hear((BATTERY,), 1.0) == (BATTERY,)
    assert bell.hear((Alarm(Kind.BATTERY, "", "13.8 V"), LINK), 2.0) == (LINK,)
    assert bell.hear((), 3.0) == ()
    # One that comes and goes at its limit is one alarm.
    assert bell.hear((LINK,), 11.0) == ()
    assert bell.hear((), 12.0) == ()
    assert bell.hear((LINK, BATTERY), 20.0) == (BATTERY,)
    assert len(rung) == 3


def test_a_sound_is_a_program_of_this_computer(tmp_path):
    sounded = tmp_path / "sounded"
    program = tmp_path / "sound"
    program.write_text(f"#!/bin/sh\n: > {sounded}\n")
    program.chmod(0o755)
    started = []
    bell = Bell(Settings(bell=False, sound=f"{program} loud"), lambda: started.append("bell"))
    bell.hear((LINK,), 0.0)
    assert bell.played.wait(60.0) == 0
    assert sounded.exists()
    assert started == []
    for sound, words in (
        ("no-such-player loud", "no program 'no-such-player'"),
        ("sh 'loud", "is not closed"),
    ):
        with pytest.raises(ConfigError, match=words):
            Bell(Settings(sound=sound), print)


def test_the_bell_rings_in_place_of_a_sound_that_cannot_be_started(tmp_path):
    program, rung = tmp_path / "sound", []
    program.write_text("a script that names no interpreter\n")
    program.chmod(0o755)
    bell = Bell(Settings(bell=False, sound=str(program)), lambda: rung.append("bell"))
    assert bell.hear((LINK,), 0.0) == (LINK,)
    assert rung == ["bell"]


def test_an_alarm_leaves_its_words_and_how_long_it_lasted_and_one_that_comes_back_at_once_goes_on():
    dive = Dive()
    dive.pictured(2.0)
    deep = {"pressure": (260_000.0, 15.0)}
    assert Kind.DEPTH in dive.pictured(3.0, **deep)
    dive.pictured(1.0)
    dive.pictured(4.0, **deep)
    (stands,) = dive.watcher.picture(dive.now_s).said
    assert stands.text.startswith("ALARM depth")
    assert stands.severity == 3
    assert Kind.DEPTH not in dive.pictured(15.0)
    (over,) = dive.watcher.picture(dive.now_s).said
    assert over.text == f"{stands.text}; over after 8 s"
    assert over.severity == 4


def test_however_many_alarms_hold_at_once_each_stands_at_the_time_at_which_it_began():
    """A bridge whose devices fail has a dozen; one that made room for another would begin anew at every picture."""
    trace = AlarmTrace()
    many = [Alarm(Kind.SENSOR, str(number), f"sensor {number}: silent for 6 s") for number in range(30)]
    for now_s in range(60):
        trace.take(many, float(now_s), float(now_s))
    assert [said.utc_s for said in trace.said(60.0)] == [0.0] * 30
    trace.take((), 90.0, 90.0)
    assert len(trace.said(90.0)) < 30


def test_an_alarm_in_the_vehicles_own_words_stands_among_them_once():
    dive = Dive().go_on(0.5)
    dive.vehicle.says(status_texts("Leak Detected", 2, 1)[0], dive.now_s)
    assert Kind.VEHICLE in dive.pictured(2.0)
    assert [said.text for said in dive.watcher.picture(dive.now_s).said] == ["Leak Detected"]


def test_no_number_of_other_words_clears_an_alarm_in_the_vehicles_own_words():
    dive = Dive().go_on(0.5)
    dive.vehicle.says(status_texts("Leak Detected", 2, 1)[0], dive.now_s)
    for number in range(40):
        dive.vehicle.says(status_texts(f"EKF3 IMU{number} is using GPS", 6, 1)[0], dive.now_s)
    assert dive.alarms == {Kind.VEHICLE: "the vehicle says: Leak Detected"}
    assert len(dive.watcher.picture(dive.now_s).said) == TEXTS_KEPT
    assert Kind.VEHICLE not in dive.pictured(31.0)
    dive.vehicle.says(status_texts("done", 6, 1)[0], dive.now_s)
    assert "Leak Detected" not in {said.text for said in dive.watcher.picture(dive.now_s).said}


def test_alarms_that_are_switched_off_are_named():
    assert Dive().watcher.picture(0.0).unset == ()
    shipped = Dive(SHIPPED).watcher.picture(0.0)
    assert shipped.unset == (Kind.BATTERY, Kind.DEPTH, Kind.ALTITUDE)
    told = f"no alarm is set for battery, depth, altitude: give limits in {user_file()}"
    assert told in header(shipped, None)
    assert unset_lines(shipped.unset, 60) == (
        (("no alarm set: battery, depth, altitude (alarms.yaml)", "quiet"),),
    )
    assert unset_lines((), 60) == ()
