"""Waiting in tests for what another thread or process does."""

import threading


def until(found, seconds=120.0):
    """What `found` finds, as soon as it does; fails where that takes longer than `seconds` of looking."""
    looking = threading.Event()
    for _ in range(round(seconds / 0.005)):
        result = found()
        if result:
            return result
        looking.wait(0.005)
    raise AssertionError("it did not come")
