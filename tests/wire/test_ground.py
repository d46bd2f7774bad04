"""Orders and parameter writes are the configured ground's alone."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect
from service_rig import Rig

from bridge.framing import Encoder
from bridge.ground import Ground
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
    (words,) = rig.ask(WRITE, Encoder(*source))
    assert words.text == told
    assert rig.ask(ARM, Encoder(*source)) == []
    assert not rig.bridge.armed
    assert rig.parameters.value("FF0_M_U") == 0.0
    assert rig.bridge.counts["refused"] == 2


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
