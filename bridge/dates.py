"""Dates in names, and the oldest time that can be true."""

import re
from datetime import UTC, datetime
from typing import Final

OLDEST_UNIX_S: Final = 1e9
"""A computer without a clock believes in 1970; no dive was recorded before this time (2001)."""

_IN_NAME = re.compile(r"(?<!\d)(\d{4})-(\d{2})-(\d{2})(?:T(\d{2})(\d{2})Z)?")


def date_in_name(name: str) -> float | None:
    """Unix time of a name such as `2026-11-20T0912Z-hovering` or `2026-11-20`; None if it holds no date."""
    match = _IN_NAME.search(name)
    if match is None:
        return None
    year, month, day, hour, minute = (int(part or 0) for part in match.groups())
    try:
        return datetime(year, month, day, hour, minute, tzinfo=UTC).timestamp()
    except ValueError:
        return None
