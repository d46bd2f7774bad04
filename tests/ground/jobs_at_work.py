"""Jobs for processes of their own, in a module that takes no time to load there."""

import os

from bridge.errors import FitError


def square(number, progress):
    progress(0.5)
    progress(1.0)
    return number * number, os.getpid()


def refuse(_progress):
    raise FitError("a dive without velocity; record the DVL")


def chatty(count, tell):
    """Tell a share so many times."""
    for n in range(count):
        tell(n / count)
