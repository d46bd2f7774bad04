"""Identifies this seatrial by its release and a hash of the code that makes answers, so that changed code shows."""

import hashlib
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PLACE = Path(__file__).resolve().parents[2]
"""Folder that holds the packages, in a checkout or installed."""

ANSWERING = (
    "bridge/*.py",
    "bridge/ftp/contents.py",
    "bridge/ftp/packet.py",
    "bridge/ring/made_since.py",
    "bridge/ring/whole.py",
    "bridge/vehicle/*.py",
    "configs/columns/*.yaml",
    "configs/thrusters/*.csv",
    "identify/*.py",
    "identify/batch/jobs.py",
    "identify/batch/work.py",
    "identify/estimators/**/*.py",
    "identify/ingest/*.py",
)
"""Files that an identification runs through: if their code changes, the answer may change."""


def our_version() -> str:
    """Text such as `0.1.0, code 3f09c1d2aa`."""
    try:
        release = version("seatrial")
    except PackageNotFoundError:
        release = "(not installed)"
    return f"{release}, code {code_stamp(PLACE)}"


def answering(place: Path) -> list[Path]:
    """Files below `place` that match ANSWERING, sorted."""
    return sorted({file for pattern in ANSWERING for file in place.glob(pattern)})


@cache
def code_stamp(place: Path) -> str:
    """Ten hexadecimal digits: a hash of the names and text of these files, computed once per process."""
    digest = hashlib.sha256()
    for file in answering(place):
        text = file.read_text(encoding="utf-8")
        digest.update(f"{file.relative_to(place).as_posix()}\0{text}\0".encode())
    return digest.hexdigest()[:10]
