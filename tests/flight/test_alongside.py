"""An identification beside a flight is a process of its own, which ends with the flight."""

import multiprocessing
import threading

from bridge.vehicle.config import load_vehicle
from tui import flying

ENDS_WITHIN_S = 20.0


def for_ever(*_):
    threading.Event().wait()


def test_one_that_nobody_waits_for_any_more_ends_at_once(tmp_path, monkeypatch):
    """A flight that a limit ended left the prompt away until its last identification was done, for minutes."""
    monkeypatch.setattr(flying, "widths_of", for_ever)
    alongside = flying.Alongside(tmp_path, load_vehicle("bluerov2"), "standard")
    alongside.ask()
    (worker,) = multiprocessing.active_children()
    alongside.close()
    worker.join(ENDS_WITHIN_S)
    assert not worker.is_alive()
