"""Orders and parameter writes are the configured ground's alone."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect
from service_rig import Rig

from bridge.framing import Encoder
from bridge.ground import Ground
from bridge.parameters import Refusal
from bridge.status_codes import CrewText, Topic, decoded
from tui import cli, exit_codes
from tui.commands.bridge import ground

WRITE = dialect.MAVLink_param_set_message(1, 1, b"FF0_M_U", 96.5, 9)
ARM = dialect.MAVLink_command_long_message(1, 1, 400, 0, 1.0, 0, 0, 0, 0, 0, 0)


@pytest.mark.parametrize(
    ("station", "source", "told"),
    [
        (Ground(), (254, 190), "orders from system 254 are refused"),
        (Ground(250), (255, 190), "orders from system 255 are refused"),
        (Ground(250, 190), (250, 191), "orders from system 250, component 191 are refused"),
        (Ground(250, 190), (255, 190), "orders from system 255 are refused"),
    ],
)
def test_an_order_of_anyone_but_the_configured_ground_changes_nothing_and_is_told(station, source, told):
    rig = Rig(ground=station)
    *pieces, error, value = rig.ask(WRITE, Encoder(*source))
    words = "".join(piece.text for piece in pieces)
    assert decoded(words) == CrewText(told, Topic.STRANGER, source[0])
    assert (error.error, value.param_value) == (Refusal.DENIED, 0.0)
    (answer,) = rig.ask(ARM, Encoder(*source))
    assert answer.result == dialect.MAV_RESULT_DENIED
    assert not rig.bridge.armed
    assert rig.parameters.value("FF0_M_U") == 0.0
    assert rig.bridge.counts["refused"] == 2


def texts(answers):
    return [answer.text for answer in answers if answer.get_type() == "STATUSTEXT"]


def test_a_strange_ground_is_told_again_after_a_while_and_many_of_them_fill_no_link():
    rig, told = Rig(), ["F4:254 orders from system 254 are refused"]
    said = []
    for time_s in (0.0, 5.0, 9.9, 10.0, 15.0, 20.0):
        rig.clock.advance_to(time_s)
        said.append(texts(rig.ask(WRITE, Encoder(254, 190))))
    assert said == [told, [], [], told, [], told]
    rig.clock.advance_to(40.0)
    at_once = [answer for system in range(2, 255) for answer in rig.ask(WRITE, Encoder(system, 190))]
    assert len(texts(at_once)) == 1
    assert sum(answer.get_type() == "PARAM_ERROR" for answer in at_once) == 50


def test_a_stranger_that_asks_for_what_is_not_there_hears_that():
    rig = Rig()
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


def test_a_write_to_everyone_is_nobodys():
    rig = Rig()
    for target in ((0, 0), (1, 0), (0, 1)):
        assert rig.ask(dialect.MAVLink_param_set_message(*target, b"FF0_M_U", 96.5, 9)) == []
    assert rig.parameters.value("FF0_M_U") == 0.0


def test_a_ground_is_named_by_its_address():
    assert ground("250") == Ground(250)
    assert ground("250:190") == Ground(250, 190)


@pytest.mark.parametrize("text", ["", "0", "256", "a", "1:2:3", "255:", "255:0", "-1"])
def test_what_is_no_address_is_refused(text, capsys):
    line = ["bridge", "--vehicle", "ruvifist", "--link", "udpin::0", f"--ground={text}"]
    assert cli.main(line) == exit_codes.BAD_INPUT
    assert "each from 1 to 255" in capsys.readouterr().err
