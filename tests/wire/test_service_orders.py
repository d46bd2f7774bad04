"""The bridge answers the ground, and takes orders from the configured ground alone."""

import math

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect
from service_rig import Rig

from bridge import exit_codes
from bridge.links.link import memory_pair
from bridge.onboard.orders import Ground
from bridge.onboard.parameters import Refusal
from bridge.onboard.program import ground
from bridge.onboard.service import Bridge
from bridge.wire.framing import Encoder, Framer
from bridge.wire.status_codes import CrewText, Topic, decoded
from tui import cli


def test_timesync_is_answered_on_the_link_that_asked_with_both_clocks(rig):
    rig.clock.advance_to(2.5)
    other_near, other_ground = memory_pair()
    bridge = Bridge(rig.vehicle, rig.clock, [*rig.links, other_near], rig.parameters)
    rig.ground.write(rig.encoder.encode(dialect.MAVLink_timesync_message(0, 123_456)))
    rig.ground.write(rig.encoder.encode(dialect.MAVLink_timesync_message(77, 88)))
    bridge.step()
    (answer,) = [m for m in rig.heard() if m.get_type() == "TIMESYNC"]
    assert (answer.tc1, answer.ts1) == (2_500_000_000, 123_456)
    while data := other_ground.read(0.0):
        assert all(frame.message_id != dialect.MAVLINK_MSG_ID_TIMESYNC for frame in Framer().feed(data))


def arm(value, system=1, component=1, command=400):
    return dialect.MAVLink_command_long_message(system, component, command, 0, value, 0, 0, 0, 0, 0, 0)


@pytest.mark.parametrize(
    ("message", "result", "armed"),
    [
        (arm(1.0), dialect.MAV_RESULT_ACCEPTED, True),
        (arm(0.0), dialect.MAV_RESULT_ACCEPTED, False),
        (arm(0.5), dialect.MAV_RESULT_DENIED, False),
        (arm(math.nan), dialect.MAV_RESULT_DENIED, False),
        (arm(1.0, command=22), dialect.MAV_RESULT_UNSUPPORTED, False),
    ],
)
def test_a_command_is_acknowledged(rig, message, result, armed):
    (ack,) = rig.ask(message)
    assert (ack.get_type(), ack.command, ack.result) == ("COMMAND_ACK", message.command, result)
    assert (ack.target_system, ack.target_component) == (255, 190)
    assert rig.bridge.armed is armed


def test_arming_waits_for_a_set_when_the_mode_applies_it(rig):
    rig.parameters.write("FF_MODE", 2.0, False)
    ack, words = rig.ask(arm(1.0))[::-1]
    assert ack.result == dialect.MAV_RESULT_DENIED
    assert words.text == "arming refused: FF_MODE needs an active set"
    for name in rig.parameters.names[:24]:
        rig.parameters.write(name, 20.0, False)
    rig.parameters.write("FF_COMMIT", float(rig.parameters.staged_crc), False)
    rig.step()
    assert rig.ask(arm(1.0))[0].result == dialect.MAV_RESULT_ACCEPTED


def test_the_list_of_parameters_is_paced(rig):
    assert len(rig.ask(dialect.MAVLink_param_request_list_message(1, 1))) == 5


def test_a_set_that_became_active_is_told_as_news_and_a_refused_one_as_a_warning(rig):

    def commit(crc):
        answers = rig.ask(dialect.MAVLink_param_set_message(1, 1, b"FF_COMMIT", float(crc), 9))
        return [(m.text, m.severity) for m in answers if m.get_type() == "STATUSTEXT"]

    rig.parameters.write("FF0_M_U", 96.5, False)
    crc = rig.parameters.staged_crc
    assert commit(crc) == [(f"F5:{crc} FF set {crc} active", dialect.MAV_SEVERITY_NOTICE)]
    assert commit(1) == [("FF_COMMIT refused: CRC is not the staged set's", dialect.MAV_SEVERITY_WARNING)]
    rig.parameters.write("FF_MODE", 3.0, False)
    rig.bridge.armed = True
    assert commit(crc) == [("FF_COMMIT refused: armed, force FF off first", dialect.MAV_SEVERITY_WARNING)]


def test_writes_that_come_too_fast_are_dropped_and_told_and_off_is_taken_all_the_same(rig):
    rig.parameters.write("FF_COMMIT", float(rig.parameters.staged_crc), False)

    def write(name, value):
        return rig.ask(dialect.MAVLink_param_set_message(1, 1, name, value, 9))

    for n in range(50):
        (*_, value) = write(b"FF_MODE", 1.0 + n % 2)
        assert value.param_value == 1.0 + n % 2
    (text,) = write(b"FF_MODE", 3.0)
    assert text.text == "writes come too fast: some are dropped"
    assert write(b"FF_MODE", 3.0) == []
    assert rig.bridge.counts["too fast"] == 2
    (value,) = write(b"FF_MODE", 0.0)
    assert (value.get_type(), value.param_value, rig.parameters.mode) == ("PARAM_VALUE", 0.0, 0)
    rig.clock.advance_to(rig.clock.now_s + 0.21)
    (value,) = (m for m in write(b"FF_MODE", 1.0) if m.get_type() == "PARAM_VALUE")
    assert value.param_value == 1.0
    assert write(b"FF_MODE", 2.0) == []


def answered(rig, kind, message, count, encoder=None):
    """How many of so many messages that come within one instant get an answer of this kind."""
    for _ in range(count):
        rig.ground.write((encoder or rig.encoder).encode(message))
    got = idle = 0
    while idle < 20:
        messages = rig.step()
        got += sum(m.get_type() == kind for m in messages)
        idle = 0 if messages else idle + 1
    return got


def test_a_thousand_writes_are_taken_at_once_and_two_hundred_a_second_of_a_flood(rig):
    write = dialect.MAVLink_param_set_message(1, 1, b"FF0_M_U", 96.5, 9)
    assert answered(rig, "PARAM_VALUE", write, 1500) == 1000
    assert rig.bridge.counts["too fast"] == 500
    rig.clock.advance_to(rig.clock.now_s + 1.0)
    assert answered(rig, "PARAM_VALUE", write, 300) == 200


def test_fifty_orders_of_strangers_are_denied_at_once_and_ten_a_second_of_a_flood():
    rig, stranger = Rig(), Encoder(42, 1)
    assert answered(rig, "COMMAND_ACK", arm(1.0), 80, stranger) == 50
    rig.clock.advance_to(rig.clock.now_s + 1.0)
    assert answered(rig, "COMMAND_ACK", arm(1.0), 30, stranger) == 10
    assert rig.bridge.counts["refused"] == 110
    assert not rig.bridge.armed


def test_its_own_frames_that_come_back_and_damaged_ones_are_ignored(rig):
    assert rig.ask(arm(1.0), Encoder(1, 1)) == []
    raw = bytearray(rig.encoder.encode(arm(1.0)))
    raw[-1] ^= 1
    rig.ground.write(bytes(raw))
    assert rig.step() == []
    assert not rig.bridge.armed


def test_an_order_behind_a_broken_start_is_heard_after_a_pause(rig):
    rig.step(1.0)
    order = rig.encoder.encode(arm(1.0))
    rig.ground.write(bytes((order[0], 255)) + order[2:] + order)
    rig.step(1.05)
    assert not rig.bridge.armed
    rig.step(1.6)
    assert rig.bridge.armed


WRITE = dialect.MAVLink_param_set_message(1, 1, b"FF0_M_U", 96.5, 9)


@pytest.mark.parametrize(
    ("station", "source", "refusal"),
    [
        (Ground(), (254, 190), "orders from system 254 are refused"),
        (Ground(250), (255, 190), "orders from system 255 are refused"),
        (Ground(250, 190), (250, 191), "orders from system 250, component 191 are refused"),
        (Ground(250, 190), (255, 190), "orders from system 255 are refused"),
    ],
)
def test_an_order_of_anyone_but_the_configured_ground_changes_nothing_and_is_told(station, source, refusal):
    rig = Rig(ground=station)
    *pieces, error, value = rig.ask(WRITE, Encoder(*source))
    words = "".join(piece.text for piece in pieces)
    assert decoded(words) == CrewText(refusal, Topic.STRANGER, source[0])
    assert (error.error, value.param_value) == (Refusal.DENIED, 0.0)
    (answer,) = rig.ask(arm(1.0), Encoder(*source))
    assert answer.result == dialect.MAV_RESULT_DENIED
    assert not rig.bridge.armed
    (value,) = rig.ask(dialect.MAVLink_param_request_read_message(1, 1, b"FF0_M_U", -1), Encoder(*source))
    assert value.param_value == 0.0
    assert rig.bridge.counts["refused"] == 2


def texts(answers):
    return [answer.text for answer in answers if answer.get_type() == "STATUSTEXT"]


def test_a_strange_ground_is_told_again_after_a_while_and_many_of_them_fill_no_link():
    rig, refusal = Rig(), ["F4:254 orders from system 254 are refused"]
    said = []
    for time_s in (0.0, 5.0, 9.9, 10.0, 15.0, 20.0):
        rig.clock.advance_to(time_s)
        said.append(texts(rig.ask(WRITE, Encoder(254, 190))))
    assert said == [refusal, [], [], refusal, [], refusal]
    rig.clock.advance_to(40.0)
    at_once = [answer for system in range(2, 255) for answer in rig.ask(WRITE, Encoder(system, 190))]
    assert len(texts(at_once)) == 1
    assert sum(answer.get_type() == "PARAM_ERROR" for answer in at_once) == 50


def test_a_stranger_that_asks_for_what_is_not_there_hears_that(rig):
    _, error = rig.ask(dialect.MAVLink_param_set_message(1, 1, b"FF0_NONE", 1.0, 9), Encoder(254, 190))
    assert error.error == Refusal.UNKNOWN


@pytest.mark.parametrize(
    ("station", "source"),
    [(Ground(), (255, 7)), (Ground(250), (250, 7)), (Ground(250, 190), (250, 190))],
)
def test_the_configured_ground_may_write(station, source):
    rig = Rig(ground=station)
    (value,) = rig.ask(WRITE, Encoder(*source))
    assert value.param_value == 96.5


@pytest.mark.parametrize("target", [(0, 0), (1, 0), (0, 1), (2, 1), (1, 191)])
def test_an_order_to_everyone_or_to_someone_else_is_left_to_them(rig, target):
    assert rig.ask(dialect.MAVLink_param_set_message(*target, b"FF0_M_U", 96.5, 9)) == []
    assert rig.ask(arm(1.0, *target)) == []
    assert rig.parameters.value("FF0_M_U") == 0.0
    assert not rig.bridge.armed


def test_a_ground_is_named_by_its_address():
    assert ground("250") == Ground(250)
    assert ground("250:190") == Ground(250, 190)


@pytest.mark.parametrize("text", ["", "0", "256", "a", "1:2:3", "255:", "255:0", "-1"])
def test_what_is_no_address_is_refused(text, capsys):
    line = ["bridge", "--vehicle", "ruvifist:hovering", "--link", "udpin::0", f"--ground={text}"]
    assert cli.main(line) == exit_codes.BAD_INPUT
    assert "each from 1 to 255" in capsys.readouterr().err
