"""When a dive began, and by which source."""

from datetime import UTC, datetime
from pathlib import Path

from bridge.dates import OLDEST_UNIX_S, date_in_name
from bridge.tlog import read_tlog
from identify.dive import Dive
from identify.ingest.open import recording_files


def date_of(dive: Dive) -> tuple[float | None, str]:
    """Unix time of the first sample and its source, in words; None and an empty string if nothing gives the time.

    The vehicle's own SYSTEM_TIME takes precedence over the recorder's stamps, and these over a date in the name.
    """
    if dive.unix_at_boot_s is not None:
        return dive.unix_at_boot_s + dive.span_s[0], "the vehicle's clock"
    stamp_s = _first_stamp_s(recording_files(dive.source)[0])
    if stamp_s is not None:
        return stamp_s, "the recorder's clock"
    named_s = date_in_name(dive.name)
    return named_s, "" if named_s is None else "its name"


def utc(unix_s: float | None) -> str:
    """`2026-11-20 09:12`; a dash for a dive without a date."""
    return "-" if unix_s is None else f"{datetime.fromtimestamp(unix_s, UTC):%Y-%m-%d %H:%M}"


def _first_stamp_s(file: Path) -> float | None:
    if not file.name.endswith((".tlog", ".tlog.gz")):
        return None
    first = next(iter(read_tlog(file)), None)
    return first[0] * 1e-6 if first is not None and first[0] * 1e-6 > OLDEST_UNIX_S else None
