"""A case's dives as a user has them: written as a recording and read again, with the rounding of a recording."""

import tempfile
from pathlib import Path

from identify.challenge.case import Case, check_of, dive_of
from identify.challenge.seal import tlog_of
from identify.dive import Dive
from identify.ingest.open import read_dive


def recorded_dive(case: Case) -> Dive:
    """The dive to diagnose."""
    return _recorded(dive_of(case), case)


def recorded_check(case: Case) -> Dive:
    """Another mission of the same vehicle."""
    return _recorded(check_of(case), case)


def _recorded(dive: Dive, case: Case) -> Dive:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{dive.name}.tlog"
        path.write_bytes(tlog_of(dive))
        return read_dive(path, None, case.file)
