"""`seatrial record` on a disk that fills up, for real: told at once, gone on in a new file, no frame missing."""

import os
import resource
import shutil
import subprocess
import sys
import time
from contextlib import closing, suppress
from pathlib import Path

import pytest
from fakes.processes import SOON_S, Running, TalkingVehicle
from fakes.recordings import raws
from figures import keep
from waiting import until

from gcs_plugin.dives.folder import list_folders

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="no limit of a running process can be set")

SHORT, LONG = 1, 20
TOLD_WITHIN_S = 1.0
ALONE = ("unshare", "--user", "--map-root-user", "--mount")
SMALL = 'mount -t tmpfs -o size=4m tmpfs "$0" && exec "$@"'


class Limited:
    """A disk on which the recorder's files may grow no more, by the limit of its process."""

    def __init__(self, folder):
        self.folder, self.command = folder, []

    def holds(self, recorder):
        self._pid = recorder.pid
        return self.folder

    def fill(self):
        resource.prlimit(self._pid, resource.RLIMIT_FSIZE, (0, resource.RLIM_INFINITY))

    def free(self):
        resource.prlimit(self._pid, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY,) * 2)


class Tmpfs:
    """A disk of 4 MB that the recorder alone has mounted."""

    def __init__(self, folder):
        self.folder, self.command = folder, [*ALONE, "sh", "-c", SMALL, str(folder)]

    def holds(self, recorder):
        self._seen = Path(f"/proc/{recorder.pid}/root{self.folder}")
        return self._seen

    def fill(self):
        filler = os.open(self._seen / "rest", os.O_WRONLY | os.O_CREAT)
        with suppress(OSError):
            while True:
                os.write(filler, bytes(1000))
        os.close(filler)

    def free(self):
        (self._seen / "rest").unlink()


def may_mount():
    """Whether whoever runs the tests may mount a disk that others do not see."""
    if shutil.which("unshare") is None:
        return False
    tried = subprocess.run([*ALONE, "sh", "-c", SMALL, "/mnt", "true"], check=False, capture_output=True)
    return tried.returncode == 0


DISKS = (Limited, *((Tmpfs,) if may_mount() else ()))


def recorded(root):
    """The frames of the dive, in the order of its files, and how many files these are."""
    (folder,) = list_folders(root)
    files = folder.telemetry()
    return raws(*files), len(files)


def fill_and_free(make, folder, times):
    """How long it took to tell of a full disk at most, where no frame is missing after so many."""
    disk, longest_s = make(folder), 0.0
    with closing(TalkingVehicle()) as vehicle:
        words = ["record", "--link", vehicle.link, "--hub", "none", "--out", str(folder)]
        recorder = Running(*words, before=disk.command)
        try:
            recorder.until("recording into")
            root = disk.holds(recorder.process)
            for _ in range(times):
                before = len(recorded(root)[0]) if any(f.stat().st_size for f in root.glob("*/*.tlog")) else 0
                until(lambda: len(vehicle.sent) > before + 100, SOON_S)  # noqa: B023
                disk.fill()
                full_s = time.monotonic()
                longest_s = max(longest_s, recorder.until("can't be written") - full_s)
                while_full = len(vehicle.sent)
                until(lambda: len(vehicle.sent) > while_full + 100, SOON_S)  # noqa: B023
                disk.free()
                recorder.until("the recording goes on in its file")
                until(lambda: len(recorded(root)[0]) > while_full + 100, SOON_S)  # noqa: B023
            enough = len(vehicle.sent)
            until(lambda: len(recorded(root)[0]) >= enough, SOON_S)
            frames, files = recorded(root)
            # A frame is on the disk before its sender has noted it.
            until(lambda: len(vehicle.sent) >= len(frames), SOON_S)
            assert frames == vehicle.sent[: len(frames)]
            assert files > times
            recorder.end()
        finally:
            recorder.kill()
    return longest_s


@pytest.mark.parametrize("disk", DISKS)
def test_a_full_disk_is_told_gone_on_from_in_a_new_file_and_no_frame_is_missing(disk, tmp_path):
    assert fill_and_free(disk, tmp_path, SHORT) > 0.0


@pytest.mark.soak
def test_a_full_disk_is_told_within_a_second_time_after_time(tmp_path):
    for disk in DISKS:
        (tmp_path / disk.__name__).mkdir()
        longest_s = fill_and_free(disk, tmp_path / disk.__name__, LONG)
        assert longest_s <= TOLD_WITHIN_S, disk
    keep("disk_full", f"{LONG} times full, told within {longest_s:.2f} s, no frame missing")
