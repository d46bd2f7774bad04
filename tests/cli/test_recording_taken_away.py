"""`record` while somebody deletes or moves its folder, and `bridge --ring` likewise: told, and nothing is missing."""

import shutil
import sys

import pytest
from fakes.processes import Running, TalkingVehicle
from fakes.recordings import raws, ring_raws
from test_bridge_ring import VEHICLE
from waiting import until

from bridge import exit_codes
from bridge.wire.whole import segments_in
from gcs_plugin.dives.folder import list_folders

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="nobody deletes an open file there")


@pytest.fixture
def running():
    begun = []

    def run(*words):
        begun.append(Running(*words))
        return begun[-1]

    yield run
    for item in begun:
        item.kill()


@pytest.fixture
def vehicle():
    made = TalkingVehicle()
    yield made
    made.close()


def begun_dive(root):
    """The dive that is recorded, once many frames are in it."""
    return until(
        lambda: next(
            (list_folder for list_folder in list_folders(root) if len(raws(*list_folder.heard())) > 100), None
        )
    )


@pytest.mark.parametrize("how", ["deleted", "moved"])
def test_a_folder_taken_from_under_a_recording_is_told_and_it_goes_on_in_a_new_one(
    running, vehicle, tmp_path, how
):
    root = tmp_path / "dives"
    record = running("record", "--link", vehicle.link, "--out", str(root), "--hub", "none")
    folder = begun_dive(root)
    shutil.rmtree(root) if how == "deleted" else root.rename(tmp_path / "aside")
    record.until("the recording goes on in its file 2")
    assert record.said(f"{folder.path / 'telemetry.tlog'}: was {how}")
    assert not record.said("MB left")
    vehicle.close()
    until(lambda: raws(*folder.heard()) and raws(*folder.heard())[-1] == vehicle.sent[-1])
    assert record.end() == exit_codes.NO
    here = raws(*folder.heard())
    assert here == vehicle.sent[-len(here) :]
    (last,) = record.said("lost here")
    assert last.startswith(f"{len(here)} frames, ")
    assert f" {len(vehicle.sent) - len(here)} lost here: {folder.path}" in last


def test_a_recording_that_was_deleted_for_good_is_not_counted_as_kept(running, vehicle, tmp_path):
    root = tmp_path / "dives"
    record = running("record", "--link", vehicle.link, "--out", str(root), "--hub", "none")
    begun_dive(root)
    shutil.rmtree(root)
    root.write_text("in the way")
    record.until("frames are not in the dive's folder any more")
    vehicle.close()
    assert record.end() == exit_codes.NO
    (last,) = record.said("lost here")
    assert last.startswith("0 frames, 0 bytes, ")
    assert " 0 lost here" not in last


def test_a_ring_deleted_under_a_bridge_is_told_and_begun_anew(running, tmp_path):
    ring, store = tmp_path / "ring", str(tmp_path / "parameters.json")
    link = ["--link", "udpout:127.0.0.1:9", "--parameters", store, "--ring", str(ring)]
    bridge = running("bridge", "--vehicle", VEHICLE, *link)
    until(lambda: ring.is_dir() and segments_in(ring))
    shutil.rmtree(ring)
    until(lambda: ring.is_dir() and any(segment.number == 2 for segment, _ in segments_in(ring)))
    until(lambda: any(b"ring: files were deleted, it begins anew" in raw for raw in ring_raws(ring)))
    bridge.end()
