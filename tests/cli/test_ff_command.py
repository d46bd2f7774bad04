"""`ff` against the vehicle's real parameter server, in simulated time."""

import json
import os
import threading
import time

import pytest
from fakes.telling import telling
from fakes.terminal import Terminal, nobody
from fakes.vehicle import FakeVehicle
from full_disk import fill
from parameter_vehicle import put_at_any_link
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge import exit_codes, reports
from gcs_plugin.feedforward.off_orders import OffMarks
from gcs_plugin.feedforward.switch import Switch
from gcs_plugin.recording.state import HeardVehicle, state_file, write_holding
from tui import cli


def afloat(clock=None, system=1):
    """A vehicle that tells its mode among other messages."""
    vehicle = FakeVehicle(clock, (system, 1), steps=clock is None)
    vehicle.chatters = True
    return vehicle


@pytest.fixture
def vehicle(monkeypatch):
    vehicle = afloat()
    put_at_any_link(monkeypatch, vehicle)
    monkeypatch.setattr("tui.commands.ff.REOPEN_EVERY_S", 0.0)
    return vehicle


def run(*line):
    return cli.main(["ff", *line, "--link", "any"])


def test_off_asks_nothing_and_ends_when_the_vehicle_has_said_so(vehicle, monkeypatch, capsys):
    nobody(monkeypatch)
    vehicle.give_a_model()
    vehicle.server.write("FF_MODE", 3.0, armed=False)
    vehicle.armed = True
    assert run("off", "--json", "-") == exit_codes.DONE
    output = json.loads(capsys.readouterr().out)
    assert (output["mode"], output["done"]) == ("off", True)
    assert output["seen"] == "vehicle 1: off, as read back and as its telemetry says"
    assert output["sent"] == len(vehicle.sets) > 0
    assert vehicle.server.mode == 0
    assert vehicle.closed


@pytest.mark.usefixtures("vehicle")
def test_who_asked_for_a_mode_has_the_answer_though_its_file_finds_no_room(tmp_path, monkeypatch, capsys):
    fill(monkeypatch, tmp_path)
    monkeypatch.setenv(reports.VARIABLE, reports.FORM)
    code = run("shadow", "--yes", "--system", "1", "--json", str(tmp_path / "result.json"))
    assert code == exit_codes.BAD_INPUT
    told = filter(None, map(reports.read, capsys.readouterr().err.splitlines()))
    (unkept,) = (report.result for report in told if report.of == reports.UNKEPT)
    assert (unkept["mode"], unkept["done"]) == ("shadow", True)


def test_off_on_a_vehicle_that_does_not_take_it_is_sent_until_the_time_given_is_up(vehicle, capsys):
    vehicle.server.write("FF_MODE", 1.0, armed=False)
    vehicle.drops = True
    assert run("off", "--seconds", "60") == exit_codes.NO
    shown = capsys.readouterr()
    assert 110 <= len(vehicle.sets) <= 120
    assert "it answers shadow, its telemetry says shadow" in shown.out
    assert len([line for line in shown.err.splitlines() if "vehicle 1: sent" in line]) == pytest.approx(
        29, abs=2
    )


@pytest.mark.usefixtures("vehicle")
@pytest.mark.parametrize("system", ["300", "0", "-1", "1.5"])
def test_a_number_that_is_no_mavlink_system_is_refused(system, capsys):
    assert run("off", "--system", system, "--seconds", "5") == exit_codes.BAD_INPUT
    assert f"--system: '{system}' is" in capsys.readouterr().err


def test_off_where_nobody_is_heard_is_the_link_that_failed(vehicle, capsys):
    vehicle.mute = True
    assert run("off", "--seconds", "5") == exit_codes.LINK
    assert "no vehicle heard, nothing is sent yet" in capsys.readouterr().out
    assert vehicle.sets == []


def recording_that_heard(vehicle, *heard):
    """One that holds the vehicle's link, and heard these."""
    write_holding(telling(written_unix_s=vehicle.clock.unix_s(), vehicles=heard))


@pytest.mark.parametrize("named", [(), ("--system", "1")])
def test_off_by_way_of_a_recording_goes_to_whom_that_has_heard_though_nothing_is_heard_now(
    vehicle, named, capsys
):
    unix_s = vehicle.clock.unix_s()
    recording_that_heard(vehicle, HeardVehicle(1, 1, True, unix_s - 8.0))
    vehicle.server.write("FF_MODE", 1.0, armed=False)
    vehicle.mute = True
    assert cli.main(["ff", "off", *named, "--seconds", "4.1"]) == exit_codes.LINK
    assert vehicle.server.mode == 0
    assert capsys.readouterr().out.startswith("vehicle 1: sent 9 times, not heard for 12 s: not confirmed")


def test_where_only_one_that_is_gone_keeps_off_from_its_end_the_way_out_is_told_once(vehicle, capsys):
    now_s = vehicle.clock.unix_s()
    recording_that_heard(vehicle, HeardVehicle(1, 1, True, now_s), HeardVehicle(2, 1, True, now_s - 60.0))
    assert cli.main(["ff", "off", "--seconds", "20"]) == exit_codes.NO
    sentence = (
        "vehicle 2 is not heard; OFF is sent until an answer comes. If it is powered down, Ctrl-C ends this"
    )
    assert " ".join(capsys.readouterr().err.split()).count(sentence) == 1


def test_off_ends_where_nothing_that_is_heard_has_a_feed_forward(vehicle, monkeypatch, capsys):
    vehicle.tells_mode = False
    no_such = dialect.MAVLink_param_error_message(255, 190, b"FF_MODE", -1, 1)
    monkeypatch.setattr(vehicle.server, "handle", lambda *_: [no_such])
    assert run("off") == exit_codes.NO
    assert 10.0 < vehicle.clock.now_s < 13.0
    assert "vehicle 1: has no feed-forward" in capsys.readouterr().out


def test_a_vehicle_that_listens_first_is_spoken_to_first(vehicle):
    vehicle.listens_first = True
    assert run("off", "--seconds", "20") == exit_codes.DONE
    assert vehicle.heard[0] == "HEARTBEAT"


def test_off_goes_on_through_every_loss_of_the_link(vehicle, capsys):
    vehicle.server.write("FF_MODE", 1.0, armed=False)
    vehicle.drops = True
    vehicle.fails_at_s.extend((3.0, 3.1, 7.0))
    assert run("off", "--seconds", "30") == exit_codes.NO
    assert capsys.readouterr().err.count("the other side has gone") == 1
    assert len(vehicle.sets) > 50


def test_control_c_ends_off_and_says_how_far_it_came(vehicle, monkeypatch, capsys):
    vehicle.server.write("FF_MODE", 1.0, armed=False)
    vehicle.drops = True
    read = vehicle.read

    def interrupted(timeout_s):
        if vehicle.clock.now_s > 9.0:
            raise KeyboardInterrupt
        return read(timeout_s)

    monkeypatch.setattr(vehicle, "read", interrupted)
    assert run("off") == exit_codes.INTERRUPTED
    assert "it answers shadow" in capsys.readouterr().out
    assert vehicle.closed


@pytest.mark.parametrize(
    ("word", "mode", "warned"), [("shadow", 1, False), ("ff", 2, True), ("both", 3, True)]
)
def test_a_disarmed_vehicle_is_switched_for_who_says_yes_and_warned_where_no_shadow_is_asked_for(
    vehicle, monkeypatch, word, mode, warned, capsys
):
    vehicle.give_a_model()
    monkeypatch.setattr("sys.stdin", Terminal("yes\n"))
    assert run(word) == exit_codes.DONE
    assert vehicle.server.mode == mode
    shown = capsys.readouterr()
    warning = f"warning: disarmed, vehicle 1 takes {word} whatever its shadow showed, and flies it once armed"
    assert (warning in " ".join(shown.err.split())) == warned
    assert f"feed-forward of vehicle 1 from off to {word}? [yes/no]" in shown.err
    assert f"vehicle 1: {word}, as read back" in shown.out


def test_shadow_without_a_model_says_that_it_computes_nothing(vehicle, capsys):
    assert run("shadow", "--yes") == exit_codes.DONE
    assert "vehicle 1 has no parameters in force: shadow computes zero" in " ".join(
        capsys.readouterr().err.split()
    )
    assert vehicle.server.mode == 1


OFF = dialect.MAVLink_param_set_message(1, 1, b"FF_MODE", 0.0, dialect.MAV_PARAM_TYPE_REAL32)


def test_off_of_another_program_while_this_one_starts_wins_and_nothing_is_sent(vehicle, capsys):
    began_unix_s = time.time() - 1.0
    OffMarks().mark([OFF])
    assert cli.main(["ff", "shadow", "--yes", "--link", "any"], began_unix_s) == exit_codes.NO
    assert "OFF was ordered meanwhile and wins" in capsys.readouterr().out
    assert vehicle.sets == []


@pytest.mark.parametrize("later_s", [-1.5, 60.0], ids=["before it began", "by a clock that was set back"])
def test_off_that_was_no_order_while_this_program_starts_does_not_stop_it(vehicle, later_s):
    OffMarks().mark([OFF])
    (mark,) = state_file().parent.glob("off-ordered-*")
    marked_s = mark.stat().st_mtime
    os.utime(mark, (marked_s + later_s,) * 2)
    assert cli.main(["ff", "shadow", "--yes", "--link", "any"], marked_s - 1.0) == exit_codes.DONE
    assert vehicle.server.mode == 1


def test_lowering_a_disarmed_vehicle_warns_of_nothing(vehicle, capsys):
    vehicle.give_a_model()
    vehicle.server.write("FF_MODE", 2.0, armed=False)
    assert run("both", "--yes") == exit_codes.DONE
    assert "warning" not in capsys.readouterr().err


def test_off_of_another_program_while_the_question_stands_wins_and_nothing_is_sent(
    vehicle, monkeypatch, capsys
):
    vehicle.give_a_model()
    order = dialect.MAVLink_param_set_message(1, 1, b"FF_MODE", 0.0, 9)
    monkeypatch.setattr("sys.stdin", Terminal("yes\n", lambda: OffMarks().mark([order])))
    assert run("both") == exit_codes.NO
    assert vehicle.sets == []
    assert "OFF was ordered meanwhile and wins: both is sent no more" in capsys.readouterr().out


@pytest.mark.parametrize(("typed", "code", "mode"), [("both\n", 0, 3), ("yes\n", 4, 0), ("\n", 4, 0)])
def test_of_an_armed_vehicle_the_modes_name_is_typed(vehicle, monkeypatch, typed, code, mode, capsys):
    vehicle.give_a_model()
    vehicle.server.unproven = lambda: ""
    vehicle.armed = True
    monkeypatch.setattr("sys.stdin", Terminal(typed))
    assert run("both") == code
    assert vehicle.server.mode == mode
    assert "it is ARMED; type both to do it" in capsys.readouterr().err


def test_one_that_is_armed_while_the_question_stands_gets_nothing_for_a_yes(vehicle, monkeypatch, capsys):
    vehicle.give_a_model()

    heard_twice, beats, say = threading.Event(), [], vehicle.say

    def says(*messages):
        say(*messages)
        beats.extend(1 for message in messages if message.get_type() == "HEARTBEAT" and message.base_mode)
        # The first has been read once the second is said.
        if len(beats) > 1:
            heard_twice.set()

    def arms():
        vehicle.armed = True
        assert heard_twice.wait(60.0)

    monkeypatch.setattr(vehicle, "say", says)
    monkeypatch.setattr("sys.stdin", Terminal("yes\n", arms))
    assert run("shadow") == exit_codes.NO
    assert "was armed meanwhile" in capsys.readouterr().err
    assert vehicle.sets == []


@pytest.mark.parametrize("options", [("--yes", "--disarmed"), ()], ids=["agreed before", "asked here"])
def test_one_that_is_armed_between_the_answer_and_the_sending_gets_nothing(
    vehicle, monkeypatch, options, capsys
):
    vehicle.give_a_model()
    vehicle.server.unproven = lambda: ""

    def switch(*of_switch, **options):
        vehicle.armed = True
        return Switch(*of_switch, **options)

    monkeypatch.setattr("tui.commands.ff.Switch", switch)
    monkeypatch.setattr("sys.stdin", Terminal("yes\n"))
    assert run("both", *options) == exit_codes.NO
    assert vehicle.sets == []
    assert "was armed meanwhile: both was not sent" in capsys.readouterr().out


@pytest.mark.parametrize("word", ["ff", "both"])
def test_a_vehicle_without_a_model_gets_no_mode_that_applies_one(vehicle, word, capsys):
    assert run(word, "--yes") == exit_codes.NO
    assert "no parameters in force to feed forward" in capsys.readouterr().err
    assert vehicle.sets == []


def test_a_vehicle_that_does_not_take_a_mode_is_given_up(vehicle, capsys):
    vehicle.drops = True
    assert run("shadow", "--yes") == exit_codes.NO
    assert "it answers off" in capsys.readouterr().out
    assert 25 <= len(vehicle.sets) <= 31


def test_an_armed_vehicle_says_what_its_shadow_lacks_and_the_crew_hears_what_to_do(vehicle, capsys):
    vehicle.give_a_model()
    vehicle.armed = True
    vehicle.server.unproven = lambda: "shadow: 28 of 60 s flown"
    assert run("both", "--yes") == exit_codes.NO
    shown = " ".join(capsys.readouterr().out.split())
    assert (
        "it answers off (the vehicle does not permit it now: armed, shadow not good yet: shadow: 28 of 60 s flown; "
        "disarm it to raise it all the same, or fly on in shadow)"
    ) in shown
    assert len(vehicle.sets) <= 3


def test_of_two_vehicles_with_one_address_none_is_switched_on(vehicle, capsys):
    vehicle.give_a_model()
    vehicle.twin = afloat(vehicle.clock)
    for _ in range(100):
        vehicle.twin.encoder.frame(0, bytes(9))
    assert run("both", "--yes") == exit_codes.LINK
    assert "two vehicles beat as system 1" in capsys.readouterr().err
    assert vehicle.sets == []


def test_a_link_that_is_lost_ends_every_mode_but_off(vehicle, capsys):
    vehicle.drops = True
    vehicle.fails_at_s.append(4.0)
    assert run("shadow", "--yes") == exit_codes.LINK
    assert "the other side has gone" in capsys.readouterr().err
    assert vehicle.closed
