"""Somebody deletes or moves the vehicle's own recording while it is written: told, and gone on from in its folder."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from test_ring import SMALL, frames, held

from bridge.clock import SimulatedClock
from bridge.onboard.ring import RingFiles, RingKeeper

STATUSTEXT_BYTES = 50


class Kept:
    """A ring in `folder`, and what it says; `put` is a second of frames."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.clock = folder, SimulatedClock()
        self.ring = RingKeeper(RingFiles(folder, SMALL, 7), 7, self.clock)
        self.said: list[str] = []
        self.ring.tell = self.said.append

    def put(self, raws: list[bytes]) -> None:
        self.clock.advance_to(self.clock.now_s + 1.0)
        self.ring.put(0, self.clock.now_s, raws)
        self.ring.work()


@pytest.fixture
def kept(tmp_path: Path) -> Kept:
    return Kept(tmp_path / "ring")


def test_a_deleted_ring_is_told_and_begun_anew_with_the_segment_that_was_open(kept: Kept) -> None:
    sent = frames(12)
    kept.put(sent[:4])
    shutil.rmtree(kept.folder)
    kept.put(sent[4:8])
    kept.put(sent[8:])
    assert kept.ring.take_texts() == ["ring: files were deleted, it begins anew"]
    segment = kept.folder / "000001-00000007-000001-0000001000.tlog"
    assert kept.said == [
        f"ring: {segment}: was deleted while it was written; a new file is begun in the folder, made anew"
    ]
    assert held(kept.folder) == sent


def test_a_moved_ring_keeps_what_it_holds_and_a_new_one_is_begun_in_its_place(kept: Kept) -> None:
    sent = frames(12)
    kept.put(sent[:4])
    elsewhere = kept.folder.rename(kept.folder.with_name("elsewhere"))
    kept.put(sent[4:8])
    kept.put(sent[8:])
    assert kept.ring.take_texts() == ["ring: files were moved away, it begins anew"]
    assert "was moved (" in kept.said[0]
    assert held(elsewhere) == sent[:8]
    assert held(kept.folder) == sent[8:]


@pytest.mark.parametrize("take", [shutil.rmtree, lambda folder: folder.rename(folder.with_name("elsewhere"))])
def test_what_the_crew_is_told_of_it_fits_one_text(kept: Kept, take: Callable[[Path], object]) -> None:
    kept.put(frames(1))
    take(kept.folder)
    kept.put(frames(1))
    (text,) = kept.ring.take_texts()
    assert len(text.encode()) <= STATUSTEXT_BYTES
