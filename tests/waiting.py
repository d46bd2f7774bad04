"""Waiting for another thread or process."""

import threading


def until(found, seconds=120.0):
    """The first true result of `found`; fails after `seconds` without one."""
    looking = threading.Event()
    for _ in range(round(seconds / 0.005)):
        result = found()
        if result:
            return result
        looking.wait(0.005)
    raise AssertionError("it did not come")
