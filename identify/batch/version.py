"""Which seatrial this is: its release, and the code in it that makes an answer, so that a change of it is told."""

import hashlib
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PLACE = Path(__file__).resolve().parents[2]
"""Where the packages lie, in a checkout or installed."""

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
"""What an identification runs through: an answer of other code than this may be another one."""


def our_version() -> str:
    """`0.1.0, code 3f09c1d2aa`."""
    try:
        release = version("seatrial")
    except PackageNotFoundError:
        release = "(not installed)"
    return f"{release}, code {code_stamp(PLACE)}"


def answering(place: Path) -> list[Path]:
    """The files of ANSWERING below `place`, in order."""
    return sorted({file for pattern in ANSWERING for file in place.glob(pattern)})


@cache
def code_stamp(place: Path) -> str:
    """Ten hexadecimal digits of these files' names and text, read once a process."""
    digest = hashlib.sha256()
    for file in answering(place):
        text = file.read_text(encoding="utf-8")
        digest.update(f"{file.relative_to(place).as_posix()}\0{text}\0".encode())
    return digest.hexdigest()[:10]
