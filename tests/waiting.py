"""Waiting for another thread or process."""

import threading
from contextlib import contextmanager

from bridge import command_line


def until(look, seconds=120.0):
    """The first true result of `look`; fails after `seconds` without one."""
    looking = threading.Event()
    for _ in range(round(seconds / 0.005)):
        result = look()
        if result:
            return result
        looking.wait(0.005)
    raise AssertionError("it did not come")


def ended_once(monkeypatch, met):
    """What a verb does until it is stopped ends once `met()` holds, however long this computer takes for it."""
    until_stopped = command_line.until_stopped

    def ended(work, clock, _seconds, each):
        came = []

        def look(since_s):
            if met():
                came.append(True)
            return each(since_s) or bool(came)

        until_stopped(work, clock, 120.0, look)
        assert came, "it did not come"

    monkeypatch.setattr("bridge.command_line.until_stopped", ended)


@contextmanager
def over_and_over(act, every_s):
    """Meanwhile `act` is called each `every_s`, in a thread of its own."""
    enough = threading.Event()

    def run():
        while not enough.wait(every_s):
            act()

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield
    finally:
        enough.set()
        thread.join(60.0)
