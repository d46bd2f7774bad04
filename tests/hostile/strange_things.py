"""Things that stand in place of a file in a stranger's folder."""

import os
from pathlib import Path

import pytest

THINGS = ["a pipe", "a link", "a link to nothing", "a link to a device", "a folder"]


def put(place: Path, thing: str, ours: Path) -> None:
    """Put something else in place of a file, as a stranger's folder may."""
    if thing == "a pipe":
        os.mkfifo(place)
    elif thing == "a folder":
        place.mkdir()
    else:
        targets = {
            "a link": ours,
            "a link to nothing": ours.with_name("nothing"),
            "a link to a device": "/dev/zero",
        }
        place.symlink_to(targets[thing])


@pytest.fixture
def ours(tmp_path: Path) -> Path:
    """A file beside the dives that a link may lead to."""
    path = tmp_path / "ours.txt"
    path.write_text("ours", encoding="utf-8")
    return path
