"""Numbers in an operator's terms: SI units, ages, durations."""

import math
from datetime import UTC, datetime
from typing import Final

NOTHING: Final = "--"
_DEGREES: Final = 180.0 / math.pi
SHOWN_IN: Final = {"rad/s": ("deg/s", _DEGREES), "rad": ("deg", _DEGREES)}
"""Units of files and lines, and the units that people read, with the factor between them."""


def number(value: float, digits: int) -> str:
    """`value` with `digits` decimals; NOTHING if it is not finite."""
    if not math.isfinite(value):
        return NOTHING
    text = f"{value:.{digits}f}"
    return text if float(text) else text.lstrip("-")


def age(seconds: float) -> str:
    """Format an age: `0.4 s`, `12 s`, `7 min`, `3 h`; `never` for infinity."""
    if not math.isfinite(seconds):
        return "never"
    if seconds < 9.95:
        return f"{max(seconds, 0.0):.1f} s"
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.0f} h"


def ago(seconds: float) -> str:
    """`12 s ago`, or `never`."""
    return f"{age(seconds)} ago" if math.isfinite(seconds) else "never"


def stopwatch(seconds: float) -> str:
    """`00:12:31`."""
    whole_s = max(0, int(seconds))
    return f"{whole_s // 3600:02d}:{whole_s // 60 % 60:02d}:{whole_s % 60:02d}"


def left(seconds: float) -> str:
    """Format the remaining time: `41 h left`, `38 min left`."""
    return f"{seconds / 3600:.0f} h left" if seconds >= 7200 else f"{max(seconds, 0.0) / 60:.0f} min left"


def day(unix_s: float) -> str:
    """Date and time of day, `2026-11-21 09:12`; dashes if unknown."""
    return f"{datetime.fromtimestamp(unix_s, UTC):%Y-%m-%d %H:%M}" if math.isfinite(unix_s) else NOTHING


def utc(unix_s: float) -> str:
    """Time of day, `09:12:31`; dashes if unknown."""
    return f"{datetime.fromtimestamp(unix_s, UTC):%H:%M:%S}" if math.isfinite(unix_s) else "--:--:--"
