"""`params upload` asks before it writes, and an armed vehicle gets nothing but on purpose."""

import threading

import params_line
import pytest
from params_line import run

from tui import exit_codes

vehicle = params_line.vehicle
file = params_line.file


def test_an_armed_vehicle_gets_no_upload(vehicle, file, capsys):
    vehicle.armed = True
    assert run("upload", file, "--yes") == exit_codes.NO
    assert "is armed; nothing was sent" in capsys.readouterr().err
    assert vehicle.server.value("FF1_M_U") == 0.0


def test_without_a_terminal_nobody_is_asked(vehicle, file, monkeypatch, capsys):
    monkeypatch.setattr("sys.stdin.isatty", lambda: False, raising=False)
    assert run("upload", file) == exit_codes.BAD_INPUT
    assert "--yes" in capsys.readouterr().err
    assert vehicle.server.value("FF1_M_U") == 0.0


@pytest.mark.parametrize(("typed", "code", "value"), [("yes\n", 0, 111.5), ("no\n", 4, 0.0), ("\n", 4, 0.0)])
def test_the_operator_is_asked_and_only_yes_means_yes(vehicle, file, monkeypatch, typed, code, value):
    class Terminal:
        def isatty(self):
            return True

        def readline(self):
            return typed

    monkeypatch.setattr("sys.stdin", Terminal())
    assert run("upload", file) == code
    assert vehicle.server.value("FF1_M_U") == value


def test_while_the_question_stands_the_link_is_read(vehicle, file, monkeypatch):
    read, ten_s = vehicle.read, threading.Event()

    def reads(timeout_s):
        data = read(timeout_s)
        if vehicle.clock.now_s > begun_s[0] + 10.0:
            ten_s.set()
        return data

    begun_s = [float("inf")]

    class Terminal:
        def isatty(self):
            return True

        def readline(self):
            begun_s[0] = vehicle.clock.now_s
            assert ten_s.wait(10.0)
            return "yes\n"

    monkeypatch.setattr(vehicle, "read", reads)
    monkeypatch.setattr("sys.stdin", Terminal())
    assert run("upload", file) == exit_codes.DONE
    assert vehicle.server.value("FF1_M_U") == 111.5


def test_one_that_is_armed_while_the_question_stands_gets_no_upload(vehicle, file, monkeypatch, capsys):
    beats = threading.Event()
    read = vehicle.read

    def reads(timeout_s):
        data = read(timeout_s)
        if vehicle.armed and vehicle.clock.now_s > armed_s[0] + 3.0:
            beats.set()
        return data

    armed_s = [0.0]

    class Terminal:
        def isatty(self):
            return True

        def readline(self):
            armed_s[0] = vehicle.clock.now_s
            vehicle.armed = True
            assert beats.wait(10.0)
            return "yes\n"

    monkeypatch.setattr(vehicle, "read", reads)
    monkeypatch.setattr("sys.stdin", Terminal())
    assert run("upload", file) == exit_codes.NO
    assert "is armed; nothing was sent" in capsys.readouterr().err


def test_an_armed_vehicle_gets_an_upload_and_its_roll_back_on_purpose(vehicle, file):
    vehicle.armed = True
    assert run("upload", file, "--yes", "--armed") == exit_codes.DONE
    assert vehicle.server.active(1)["M_u"] == 111.5
    vehicle.clock.advance_to(vehicle.clock.now_s + 2.0)
    assert run("rollback", "--yes") == exit_codes.NO
    assert run("rollback", "--yes", "--armed") == exit_codes.DONE
    assert "M_u" not in vehicle.server.active(1)
