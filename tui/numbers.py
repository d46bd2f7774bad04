"""Numbers on the command line, checked before anything begins; argparse turns ValueError into its own sentence."""

import argparse
import math


def seconds(text: str) -> float:
    """A positive number of seconds."""
    value = _number(text)
    if not value > 0:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number of seconds above 0")
    return value


def above_zero(text: str) -> float:
    """A positive number."""
    value = _number(text)
    if not value > 0:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number above 0")
    return value


def seed(text: str) -> int:
    """A whole number from 0."""
    return _whole(text, 0)


def size(text: str) -> int:
    """A whole number from 1."""
    return _whole(text, 1)


def port(text: str) -> int:
    """A TCP or UDP port; 0 means any free port."""
    value = _whole(text, 0)
    if value > 65535:
        raise argparse.ArgumentTypeError(f"'{text}' is no port; give a number up to 65535")
    return value


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    return value if math.isfinite(value) else math.nan


def _whole(text: str, least: int) -> int:
    try:
        value = int(text)
    except ValueError:
        value = least - 1
    if value < least:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number from {least}")
    return value
