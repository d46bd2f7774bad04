"""The picture of a vehicle: which is watched, armed or not, its links and words."""

import math

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav
from vehicle_on_air import LINK, OnAir, dvl, imu

from bridge.vehicle.config import load_vehicle
from bridge.wire.framing import Framer
from bridge.wire.readings import TABLE
from bridge.wire.status_codes import Topic, coded, status_texts
from gcs_plugin.watch.channels import StatusTexts
from gcs_plugin.watch.picture import Armed, Condition, Freshness, Kind
from gcs_plugin.watch.watcher import Watcher
from tui.watch_text import header

RUVIFIST = load_vehicle("ruvifist")


def test_before_anything_came_the_picture_claims_nothing(watcher):
    picture = watcher.picture(5.0)
    assert picture.armed is Armed.UNKNOWN
    assert picture.armed_age_s == math.inf
    assert picture.links == picture.said == ()
    assert {row.condition for row in picture.sensors} == {Condition.AWAITED}
    assert {row.words for row in picture.sensors} == {"not heard yet"}
    assert {trace.freshness for trace in picture.traces.values()} == {Freshness.GONE}
    assert picture.ff_mode is None


@pytest.mark.parametrize(
    ("value", "mode"), [(2.0, 2), (0.4, None), (math.nan, None), (math.inf, None), (-math.inf, None)]
)
def test_a_mode_that_is_no_whole_number_is_not_known(watcher, vehicle, value, mode):
    vehicle.beats(1.0)
    vehicle.tells("ff_mode", (value,), 1.0)
    assert watcher.picture(1.0).ff_mode == mode


@pytest.mark.parametrize("signal", [row.name for row in TABLE])
def test_every_signal_of_the_contract_is_heard(watcher, vehicle, signal):
    vehicle.beats(1.0)
    values = {
        "alive": 3,
        "pwm": 8,
        "rpm": 58,
        "nu_ref": 14,
        "gnss": 8,
        "imu": 7,
        "attitude": 7,
        "dvl": 4,
    }.get(signal, 6)
    vehicle.tells(signal, (1.0,) * values, 1.0)
    assert watcher.picture(1.0).links


@pytest.mark.parametrize(
    ("how", "state"),
    [
        ({"armed": False}, Armed.DISARMED),
        ({"armed": True}, Armed.ARMED),
        ({"armed": True, "status": mav.MAV_STATE_CRITICAL}, Armed.FAILSAFE),
        ({"armed": False, "status": mav.MAV_STATE_EMERGENCY}, Armed.FAILSAFE),
    ],
)
def test_the_armed_state_is_the_vehicles_own(watcher, vehicle, how, state):
    vehicle.beats(1.0, **how)
    assert watcher.picture(1.5).armed is state
    assert watcher.picture(1.5).armed_age_s == pytest.approx(0.5)


def test_a_ground_station_is_no_vehicle_and_no_link_row(watcher, vehicle):
    OnAir(watcher, 255, 190).beats(
        0.5, kind=mav.MAV_TYPE_GCS, autopilot=mav.MAV_AUTOPILOT_INVALID, armed=True
    )
    assert watcher.picture(0.6).armed is Armed.UNKNOWN
    vehicle.beats(1.0)
    assert [(row.system, row.component) for row in watcher.picture(1.0).links] == [(1, 1)]


def test_an_autopilots_word_on_arming_counts_before_its_companions(watcher):
    bridge, autopilot = OnAir(watcher, 1, 191), OnAir(watcher, 1, 1)
    companion = {"kind": mav.MAV_TYPE_ONBOARD_CONTROLLER, "autopilot": mav.MAV_AUTOPILOT_INVALID}
    bridge.beats(1.0, armed=False, **companion)
    assert watcher.picture(1.0).armed is Armed.DISARMED
    autopilot.beats(1.1, armed=True, autopilot=mav.MAV_AUTOPILOT_ARDUPILOTMEGA)
    bridge.beats(1.2, armed=False, **companion)
    picture = watcher.picture(1.3)
    assert picture.armed is Armed.ARMED
    assert [row.component for row in picture.links] == [1, 191]


def test_another_vehicle_on_the_link_stays_out_of_the_picture_but_for_its_row(watcher, vehicle):
    other = OnAir(watcher, 7)
    vehicle.beats(1.0)
    vehicle.tells("dvl", dvl(0.2), 1.1)
    other.beats(1.1, armed=True)
    other.tells("dvl", dvl(0.9), 1.15)
    other.says(status_texts("I am another", 4, 1)[0], 1.2)
    picture = watcher.picture(1.3)
    assert picture.armed is Armed.DISARMED
    assert picture.traces["u"].value.tolist() == pytest.approx([0.2])
    assert picture.said == ()
    assert [row.system for row in picture.links] == [1, 7]


def test_the_vehicle_that_the_file_names_is_watched_as_soon_as_it_beats(watcher, vehicle):
    other = OnAir(watcher, 7)
    other.beats(1.0, armed=True)
    other.tells("dvl", dvl(0.9), 1.1)
    assert watcher.picture(1.2).armed is Armed.ARMED
    vehicle.beats(1.3)
    other.beats(1.4, armed=True)
    picture = watcher.picture(1.5)
    assert picture.armed is Armed.DISARMED
    assert len(picture.traces["u"].value) == 0


@pytest.mark.parametrize("odd", [math.inf, -math.inf, math.nan])
def test_angles_that_are_no_numbers_are_unknown_and_end_nothing(odd):
    watcher = Watcher(None)
    vehicle = OnAir(watcher)
    vehicle.beats(1.0)
    vehicle.says(mav.MAVLink_attitude_message(0, odd, 0.0, 0.1, 0.0, 0.0, 0.2), 1.1)
    assert all(map(math.isnan, watcher.picture(1.2).traces["heading"].value))
    vehicle.says(mav.MAVLink_attitude_message(0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.2), 1.3)
    assert watcher.picture(1.4).traces["heading"].value[-1] == pytest.approx(math.degrees(0.1))


def test_who_beats_once_and_is_silent_is_left_for_the_next_that_beats():
    watcher = Watcher(None)
    OnAir(watcher, 9).beats(1.0, armed=True)
    OnAir(watcher, 1).beats(11.0)
    assert watcher.system == 9
    OnAir(watcher, 1).beats(11.1)
    assert watcher.system == 1
    assert watcher.picture(11.2).armed is Armed.DISARMED


@pytest.mark.parametrize(("file", "beats"), [(None, 3), (RUVIFIST, 1)])
def test_a_vehicle_that_has_settled_or_that_the_file_names_is_watched_however_long_it_is_silent(file, beats):
    watcher = Watcher(file)
    for k in range(beats):
        OnAir(watcher).beats(1.0 + k)
    OnAir(watcher, 9).beats(1000.0)
    assert watcher.system == 1


def test_a_link_is_lost_three_seconds_after_the_last_heartbeat(watcher, vehicle):
    vehicle.beats(1.0)
    vehicle.tells("imu", imu(), 4.2)
    (row,) = watcher.picture(3.9).links
    assert not row.lost
    (row,) = watcher.picture(4.5).links
    assert row.lost
    assert row.age_s == pytest.approx(3.5)


def test_of_links_the_one_that_is_there_comes_first_and_where_all_are_lost_the_one_heard_last(
    watcher, vehicle
):
    radio = OnAir(watcher, link="radio")
    vehicle.beats(1.0)
    radio.beats(30.0)
    assert [row.name for row in watcher.picture(30.5).links] == ["radio", LINK]
    first, second = watcher.picture(40.0).links
    assert (first.name, first.age_s) == ("radio", pytest.approx(10.0))
    assert (second.name, second.age_s) == (LINK, pytest.approx(39.0))


def test_another_system_that_is_long_gone_is_shown_no_more_and_the_vehicle_itself_is(watcher, vehicle):
    other = OnAir(watcher, 7)
    vehicle.beats(1.0)
    other.beats(1.0)
    assert [row.system for row in watcher.picture(61.0).links] == [1, 7]
    assert [row.system for row in watcher.picture(61.1).links] == [1]


def test_loss_and_rate_are_those_of_the_last_seconds(watcher, vehicle):
    vehicle.beats(0.0)
    for k in range(1, 400):
        raw = vehicle.encoder.encode(mav.MAVLink_system_time_message(0, 50 * k))
        if k < 200 or k % 4:
            vehicle.raw(raw, 0.05 * k)
    vehicle.beats(20.0)
    (row,) = watcher.picture(20.0).links
    assert row.loss == pytest.approx(0.25, abs=0.02)
    assert row.rate_hz == pytest.approx(15, rel=0.1)


def test_frames_without_any_heartbeat_show_as_a_lost_link_once_there_was_time_for_it(watcher, vehicle):
    vehicle.tells("imu", imu(), 1.0)
    (row,) = watcher.picture(4.0).links
    assert (row.lost, row.age_s) == (False, math.inf)
    (row,) = watcher.picture(4.1).links
    assert (row.lost, row.age_s) == (True, math.inf)


@pytest.mark.parametrize(("ground_s", "zero_s"), [(math.nan, 1.8e9 - 2.0), (1.7e9, 1.7e9)])
def test_words_are_joined_dated_and_kept_with_their_severity(ground_s, zero_s):
    watcher = Watcher(RUVIFIST, unix_at_zero_s=ground_s)
    vehicle = OnAir(watcher)
    vehicle.beats(1.0)
    vehicle.tells("clock", (1.8e9,), 2.0)
    for number in range(25):
        vehicle.says(status_texts(f"text {number}", 6, 2 + number)[0], 4.0)
    said = watcher.picture(5.0).said
    assert len(said) == 20
    assert said[-1].text == "text 24"
    assert said[-1].utc_s == pytest.approx(zero_s + 4.0)
    vehicle.says(status_texts("leak", 2, 99)[0], 6.0)
    assert (watcher.picture(6.0).said[-1].severity, watcher.picture(6.0).said[-1].text) == (2, "leak")


def test_long_words_come_whole_and_can_not_steer_a_terminal(watcher, vehicle):
    vehicle.beats(1.0)
    for message in status_texts("depth \x1b[2Jhold " + "is lost " * 12, 3, 1):
        vehicle.says(message, 3.0)
    (said,) = watcher.picture(4.0).said
    assert said.text.startswith("depth [2Jhold is lost")
    assert said.text.count("is lost") == 12
    assert math.isnan(said.utc_s)


WORDS = " ".join(f"word {number} of a long text," for number in range(6))


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1), (1, 1, 0, 2, 2, 0), (0, 0, 1, 2, 2)])
def test_the_pieces_of_a_text_may_come_twice_and_out_of_their_order(vehicle, order):
    said = []
    texts, pieces = StatusTexts(lambda *text: said.append(text[2].words)), status_texts(WORDS, 3, 7)
    for place in order:
        (frame,) = Framer().feed(vehicle.encoder.encode(pieces[place]))
        texts.hear(frame)
    assert said == [WORDS]


@pytest.mark.parametrize(
    ("lost", "words"),
    [(0, f" ... {WORDS[50:]}"), (1, f"{WORDS[:50]} ... {WORDS[100:]}"), (2, f"{WORDS[:100]} ... ")],
)
def test_a_piece_that_was_lost_shows_as_a_gap_and_joins_no_words(watcher, vehicle, lost, words):
    vehicle.beats(1.0)
    for place, message in enumerate(status_texts(WORDS, 3, 7)):
        if place != lost:
            vehicle.says(message, 3.0)
    vehicle.beats(4.0)
    (said,) = watcher.picture(4.0).said
    assert said.text == words


def test_two_vehicles_under_one_address_are_told(watcher):
    first, second = OnAir(watcher), OnAir(watcher)
    second.encoder._packer.seq = 128
    for k in range(20):
        first.beats(float(k))
        second.beats(k + 0.5)
    assert "two vehicles beat as system 1, component 1" in watcher.picture(20.0).twins
    assert LINK in watcher.picture(20.0).twins


def test_a_frame_that_comes_over_two_links_counts_once(watcher, vehicle):
    radio = OnAir(watcher, link="radio")
    vehicle.beats(0.0)
    for k in range(1, 60):
        raw = vehicle.encoder.encode(mav.MAVLink_attitude_quaternion_message(100 * k, 1, 0, 0, 0, 0, 0, 0))
        vehicle.raw(raw, 0.1 * k)
        radio.raw(raw, 0.1 * k + 0.03)
    (row,) = [row for row in watcher.picture(6.0).sensors if row.signal == "attitude"]
    assert row.rate_hz == pytest.approx(10.0, rel=0.05)


def test_feed_forward_mode_configuration_and_thrusters_are_those_last_told(watcher, vehicle):
    vehicle.beats(1.0)
    assert watcher.picture(1.0).configuration == ""
    vehicle.tells("ff_mode", (1.0,), 1.0)
    vehicle.tells("veh_cfg", (1.0,), 1.0)
    vehicle.tells("pwm", (1550.0,) * 8, 1.5)
    picture = watcher.picture(2.0)
    assert (picture.ff_mode, picture.ff_mode_age_s) == (1, pytest.approx(1.0))
    assert picture.configuration == "hovering"
    assert [row.number for row in picture.thrusters] == list(range(1, 9))
    assert picture.thrusters[0].name == "fore port"
    assert picture.thrusters[4].name == "vertical fore starboard"
    assert picture.thrusters[0].pwm_us == 1550.0
    assert math.isnan(picture.thrusters[0].rpm)
    vehicle.tells("rpm", (-900.0,) + (0.0,) * 57, 2.0)
    assert watcher.picture(2.0).thrusters[0].rpm == -900.0


def test_a_configuration_that_the_vehicle_file_does_not_have_speaks_against_the_file(watcher, vehicle):
    vehicle.beats(1.0)
    vehicle.tells("veh_cfg", (1.0,), 1.0)
    assert watcher.picture(1.0).wrong_file == ""
    vehicle.tells("veh_cfg", (7.0,), 2.0)
    assert watcher.picture(2.0).wrong_file == (
        "the vehicle says configuration 7, and the file of 'ruvifist' has 0 survey, 1 hovering: "
        "name the vehicle's own with --vehicle"
    )


def value_of(name, value):
    return mav.MAVLink_param_value_message(name.encode(), value, mav.MAV_PARAM_TYPE_REAL32, 9, 3)


@pytest.mark.parametrize(
    "message",
    [
        status_texts(coded(Topic.SET_ACTIVE, "any words", 13247), 6, 1)[0],
        value_of("FF_ACTIVE", 13247.0),
        value_of("FF_COMMIT", 13247.0),
    ],
)
def test_the_set_that_flies_is_known_by_word_and_by_any_read_of_it(watcher, vehicle, message):
    vehicle.beats(1.0)
    assert (watcher.picture(1.0).active_set, watcher.picture(1.0).active_set_age_s) == (None, math.inf)
    vehicle.says(message, 2.0)
    assert (watcher.picture(5.0).active_set, watcher.picture(5.0).active_set_age_s) == (13247, 3.0)


@pytest.mark.parametrize(
    "message",
    [status_texts("FF set 13247 active", 6, 1)[0], value_of("FF_MODE", 2.0), value_of("FF_ACTIVE", math.inf)],
)
def test_other_words_values_and_vehicles_tell_nothing_of_the_set_that_flies(watcher, vehicle, message):
    vehicle.beats(1.0)
    vehicle.says(message, 2.0)
    OnAir(watcher, 7).says(value_of("FF_ACTIVE", 13247.0), 2.0)
    assert watcher.picture(3.0).active_set is None


@pytest.mark.parametrize(("armed", "severity"), [(False, 6), (True, 4)])
def test_a_vehicle_that_was_switched_off_disarmed_and_comes_back_is_no_warning(armed, severity):
    watcher = Watcher(RUVIFIST, unix_at_zero_s=1_790_000_000.0)
    vehicle = OnAir(watcher)
    for at_s in (*range(30), *range(60, 90)):
        vehicle.beats(float(at_s), armed=armed and at_s < 30)
        boot_s = at_s + 100 if at_s < 30 else at_s - 55
        vehicle.says(mav.MAVLink_system_time_message(0, boot_s * 1000), float(at_s))
    (said,) = watcher.picture(90.0).said
    assert said.severity == severity


def test_what_a_vehicle_said_before_it_started_anew_is_past():
    watcher = Watcher(RUVIFIST, unix_at_zero_s=1_790_000_000.0)
    vehicle = OnAir(watcher)
    for at_s in (*range(30), *range(60, 90)):
        vehicle.beats(float(at_s))
        boot_s = at_s + 100 if at_s < 30 else at_s - 55
        vehicle.says(mav.MAVLink_system_time_message(0, boot_s * 1000), float(at_s))
        if at_s in (20, 60):
            vehicle.says(mav.MAVLink_statustext_message(4, b"FF surge off"), float(at_s))
    texts = [(said.past, said.text.startswith("FF")) for said in watcher.picture(90.0).said]
    assert sorted(texts) == [(False, False), (False, True), (True, True)]
    assert " ".join(header(watcher.picture(90.0), None)).count("FF surge off") == 1


def test_what_a_set_lacked_is_past_once_another_is_in_force():
    watcher = Watcher(RUVIFIST, unix_at_zero_s=1_790_000_000.0)
    vehicle = OnAir(watcher)
    vehicle.beats(1.0)

    def said(words, at_s):
        vehicle.says(status_texts(words, 4, 1)[0], at_s)

    lacks = (coded(Topic.SET_FAULT, f"FF {axis} off") for axis in ("surge", "sway"))
    said(next(lacks), 2.0)
    said("DVL silent: check cable", 3.0)
    said(coded(Topic.SET_ACTIVE, "FF set 13247 active", 13247), 4.0)
    said(next(lacks), 5.0)
    assert [(said.text, said.past) for said in watcher.picture(6.0).said] == [
        ("FF surge off", True),
        ("DVL silent: check cable", False),
        ("FF set 13247 active", False),
        ("FF sway off", False),
    ]


@pytest.mark.parametrize(
    ("armed", "mode", "past"), [(False, 3.0, False), (True, 3.0, True), (False, 1.0, True)]
)
def test_that_the_feed_forward_acts_once_armed_is_past_once_it_is_armed_or_acts_no_more(
    watcher, vehicle, armed, mode, past
):
    vehicle.beats(1.0)
    vehicle.says(status_texts(coded(Topic.ONCE_ARMED, "FF both: acts once armed"), 4, 1)[0], 1.0)
    vehicle.beats(2.0, armed=armed)
    vehicle.tells("ff_mode", (mode,), 2.0)
    (said,) = watcher.picture(2.5).said
    assert (said.text, said.past) == ("FF both: acts once armed", past)


def test_what_a_vehicle_said_before_it_started_anew_is_no_alarm_any_more():
    watcher = Watcher(RUVIFIST, unix_at_zero_s=1_790_000_000.0)
    vehicle, alarms = OnAir(watcher), {}
    for at_s in (*range(20), *range(28, 34)):
        vehicle.beats(float(at_s))
        boot_s = at_s + 100 if at_s < 20 else at_s - 24
        vehicle.says(mav.MAVLink_system_time_message(0, boot_s * 1000), float(at_s))
        if at_s == 15:
            vehicle.says(mav.MAVLink_statustext_message(2, b"Leak Detected"), float(at_s))
        alarms[at_s] = [alarm.kind for alarm in watcher.picture(at_s + 0.5).alarms]
    assert Kind.VEHICLE in alarms[19]
    assert Kind.VEHICLE not in alarms[33]  # it would be, had the vehicle not started anew


def test_a_vehicle_that_starts_anew_is_told_of_among_its_words_and_another_is_not():
    watcher = Watcher(RUVIFIST, unix_at_zero_s=1_790_000_000.0)
    ours, other = OnAir(watcher), OnAir(watcher, 7)
    for at_s in range(60):
        for vehicle, boot_s in (
            (ours, (at_s + 100) if at_s < 30 else at_s - 29.5),
            (other, at_s % 30 + 0.25),
        ):
            vehicle.beats(float(at_s))
            vehicle.says(mav.MAVLink_system_time_message(0, round(boot_s * 1e3)), float(at_s))
    (said,) = watcher.picture(60.0).said
    words = "vehicle 1 started anew at 14:13:49 UTC (its clock went back to 0 s)"
    assert (said.severity, said.text, said.utc_s) == (4, words, 1_790_000_033.0)
