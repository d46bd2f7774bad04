"""`record` while somebody deletes or moves its folder, and `bridge --ring` likewise: told, and nothing is missing."""

import os
import shutil
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from talking_vehicle import TalkingVehicle
from test_bridge_ring import VEHICLE
from waiting import until

from bridge import exit_codes
from bridge.wire.segments import segments_in
from bridge.wire.tlog import of_those_that_hold_frames, read_tlog
from gcs_plugin.dives.folder import list_folders

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="nobody deletes an open file there")

ROOT = Path(__file__).resolve().parents[2]


class Running:
    """A command in a process of its own, and all that it says."""

    def __init__(self, *words):
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tui", *words],
            cwd=ROOT,
            env={**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "1000"},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self.lines = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self._process.stdout:
            self.lines.append(line.rstrip())

    def said(self, words):
        return [line for line in self.lines if words in line]

    def end(self):
        self._process.send_signal(signal.SIGINT)
        code = self._process.wait(120.0)
        self._reader.join(120.0)
        return code

    def kill(self):
        self._process.kill()
        self._process.wait(120.0)
        self._reader.join(120.0)
        self._process.stdout.close()


@pytest.fixture
def running():
    begun = []

    def run(*words):
        begun.append(Running(*words))
        return begun[-1]

    yield run
    for one in begun:
        one.kill()


@pytest.fixture
def vehicle():
    made = TalkingVehicle()
    yield made
    made.close()


def recorded(folder):
    files = [file for file in folder.heard() if file.stat().st_size]
    return [frame.raw for records in of_those_that_hold_frames(files, read_tlog) for _, frame in records]


def begun_dive(root):
    """The dive that is recorded, once many frames are in it."""
    return until(lambda: next((one for one in list_folders(root) if len(recorded(one)) > 100), None))


@pytest.mark.parametrize("how", ["deleted", "moved"])
def test_a_folder_taken_from_under_a_recording_is_told_and_it_goes_on_in_a_new_one(
    running, vehicle, tmp_path, how
):
    root = tmp_path / "dives"
    record = running("record", "--link", vehicle.link, "--out", str(root), "--hub", "none")
    folder = begun_dive(root)
    shutil.rmtree(root) if how == "deleted" else root.rename(tmp_path / "aside")
    until(lambda: record.said("the recording goes on in its file 2"))
    assert record.said(f"{folder.path / 'telemetry.tlog'}: was {how}")
    assert not record.said("MB left")
    vehicle.close()
    until(lambda: recorded(folder) and recorded(folder)[-1] == vehicle.sent[-1])
    assert record.end() == exit_codes.NO
    here = recorded(folder)
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
    until(lambda: record.said("frames are not in the dive's folder any more"))
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
    bridge.end()
    texts = [
        frame.payload
        for segment, size in segments_in(ring)
        if size
        for _, frame in read_tlog(ring / segment.name)
    ]
    assert any(b"ring: files were deleted, it begins anew" in payload for payload in texts)
