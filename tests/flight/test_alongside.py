"""An identification beside a flight is a process of its own, which ends with the flight."""

import multiprocessing
import os
import signal
import threading

from bridge.vehicle.config import load_vehicle
from tui import flight_recording as flying

STARTS_WITHIN_S = 120.0


def for_ever(*_):
    threading.Event().wait()


def known_at_once(*_):
    return {"X_u": 0.04}


def dies(*_):
    os._exit(1)


def test_one_that_nobody_waits_for_any_more_ends_at_once(tmp_path, monkeypatch):
    """A flight that a limit ended left the prompt away until its last identification was done, for minutes."""
    monkeypatch.setattr(flying, "widths_of", for_ever)
    alongside = flying.Alongside(tmp_path, load_vehicle("bluerov2"), "standard")
    alongside.ask()
    (worker,) = multiprocessing.active_children()
    assert worker.is_alive()
    alongside.close()
    assert multiprocessing.active_children() == []


def test_its_answer_comes_once(tmp_path, monkeypatch):
    monkeypatch.setattr(flying, "widths_of", known_at_once)
    alongside = flying.Alongside(tmp_path, load_vehicle("bluerov2"), "standard")
    alongside.ask()
    assert alongside._pipe.poll(STARTS_WITHIN_S)
    assert alongside.answer() == {"X_u": 0.04}
    assert alongside.answer() is None
    alongside.close()


def test_nothing_is_known_by_one_that_died(tmp_path, monkeypatch):
    """A flight goes on without it, by its plan alone."""
    monkeypatch.setattr(flying, "widths_of", dies)
    alongside = flying.Alongside(tmp_path, load_vehicle("bluerov2"), "standard")
    alongside.ask()
    assert alongside._pipe.poll(STARTS_WITHIN_S)
    assert alongside.answer() == {}
    alongside.close()


def test_nothing_is_known_by_one_that_was_killed_before_it_took_what_was_asked(tmp_path):
    alongside = flying.Alongside(tmp_path, load_vehicle("bluerov2"), "standard")
    (worker,) = multiprocessing.active_children()
    alongside.ask()
    os.kill(worker.pid, signal.SIGKILL)
    assert alongside._pipe.poll(STARTS_WITHIN_S)
    assert alongside.answer() == {}
    alongside.close()


def test_ctrl_c_is_the_flights_alone_also_while_it_starts(tmp_path, monkeypatch):
    """It ended with a page of errors on the screen of a crew that was ending a flight."""
    monkeypatch.setattr(flying, "widths_of", known_at_once)
    alongside = flying.Alongside(tmp_path, load_vehicle("bluerov2"), "standard")
    (worker,) = multiprocessing.active_children()
    os.kill(worker.pid, signal.SIGINT)
    alongside.ask()
    assert alongside._pipe.poll(STARTS_WITHIN_S)
    assert alongside.answer() == {"X_u": 0.04}
    alongside.close()
