"""The version of the code that answers, so that the cache never gives an answer of other code."""

import hashlib
from functools import cache
from pathlib import Path

from bridge.version import installed

PLACE = Path(__file__).resolve().parents[2]
"""Folder that holds the packages, in a checkout or installed."""

ANSWERING = (
    "bench/reproduce/paper.py",
    "bridge/*.py",
    "bridge/firmware/*.py",
    "bridge/vehicle/*.py",
    "bridge/wire/*.py",
    "configs/columns/*.yaml",
    "configs/thrusters/*.csv",
    "identify/*.py",
    "identify/batch/code_version.py",
    "identify/batch/dive_causes.py",
    "identify/batch/dive_jobs.py",
    "identify/batch/jobs.py",
    "identify/checks/**/*.py",
    "identify/diagnose/**/*.py",
    "identify/effects/*.py",
    "identify/estimators/**/*.py",
    "identify/ingest/**/*.py",
    "identify/run/__init__.py",
    "identify/run/diagnose.py",
    "identify/run/identify.py",
    "identify/thrust/*.py",
)
"""The files whose code an identification or a diagnosis runs: when one of them changes, so may an answer."""


def our_version() -> str:
    """The version of seatrial and the stamp of its code: `0.1.0, code 3f09c1d2aa`."""
    return f"{installed()}, code {code_stamp(PLACE)}"


def answering(place: Path) -> list[Path]:
    """Files below `place` that match ANSWERING, sorted."""
    return sorted({file for pattern in ANSWERING for file in place.glob(pattern)})


@cache
def code_stamp(place: Path) -> str:
    """Ten hexadecimal digits: a hash of names and text of the `answering` files, computed once per process."""
    digest = hashlib.sha256()
    for file in answering(place):
        text = file.read_text(encoding="utf-8")
        digest.update(f"{file.relative_to(place).as_posix()}\0{text}\0".encode())
    return digest.hexdigest()[:10]
