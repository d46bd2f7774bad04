"""Waiting for another thread or process."""

import threading
from contextlib import contextmanager


def until(look, seconds=120.0):
    """The first true result of `look`; fails after `seconds` without one."""
    looking = threading.Event()
    for _ in range(round(seconds / 0.005)):
        result = look()
        if result:
            return result
        looking.wait(0.005)
    raise AssertionError("it did not come")


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
