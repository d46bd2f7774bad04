"""Recordings after a loss of power at any moment, on a disk that keeps only synced bytes and names."""

import os
import shutil

import pytest
from fakes.recordings import raws, ring_raws

from bridge.clock import SimulatedClock
from bridge.links.link import memory_pair
from bridge.onboard.ring import RingFiles, RingKeeper, RingSize
from bridge.onboard.store import Stored, load, save
from bridge.signing.key import new_key, write_key
from bridge.wire.framing import Encoder
from bridge.wire.segments import segments_in
from gcs_plugin.dives.folder import About, DiveFolder, new_folder
from gcs_plugin.fetch.mirror import Mirror
from gcs_plugin.params.files import read_parameters
from gcs_plugin.params.plan import make_plan
from gcs_plugin.params.receipt import begin, kept_in, new_preimage
from gcs_plugin.params.transfer import Outcome
from gcs_plugin.recording.recorder import Recorder

STEP_S = 0.05
UNIX_S = 1_790_000_000.0


class Disk:
    """The disk after a loss of power: names in folders and bytes of files as of their last sync."""

    def __init__(self, monkeypatch):
        self.names, self.bytes = {}, {}
        self._fsync = os.fsync
        monkeypatch.setattr("os.fsync", self._sync)

    def _sync(self, file):
        self._fsync(file)
        seen = os.fstat(file)
        path = os.readlink(f"/proc/self/fd/{file}")
        if os.path.isdir(path):
            self.names[seen.st_ino] = {entry.name for entry in os.scandir(path)}
        else:
            self.bytes[seen.st_ino] = seen.st_size

    def after(self, folder, copy):
        """The folder, which was there long before, as it is once the power is back, in a new one."""
        shutil.rmtree(copy, ignore_errors=True)
        copy.mkdir()
        kept = self.names.get(folder.stat().st_ino, set())
        for entry in folder.iterdir():
            if entry.name not in kept:
                continue
            if entry.is_dir():
                self.after(entry, copy / entry.name)
            else:
                (copy / entry.name).write_bytes(entry.read_bytes()[: self.bytes.get(entry.stat().st_ino, 0)])
        return copy


@pytest.fixture
def disk(monkeypatch):
    return Disk(monkeypatch)


class Power:
    """Stands in for the end of a recording: while it is waited for, frames come, and after each the power may fail."""

    def __init__(self, disk, folder, seconds):
        self.disk, self.folder, self.left_s = disk, folder, seconds
        self.clock, self.encoder, self.said, self.looks = SimulatedClock(), Encoder(1, 1), [], 0
        ours, self.vehicle = memory_pair()
        self.dive = new_folder(folder, UNIX_S, "lake")
        self.recorder = Recorder(
            [ours], self.dive.open_telemetry, self.clock, lambda: 1 << 40, lambda _: None
        )

    def wait(self, timeout_s):
        for _ in range(round(timeout_s / STEP_S)):
            self.clock.advance_to(self.clock.now_s + STEP_S)
            raw = self.encoder.frame(30, bytes(28))
            self.vehicle.write(raw)
            self.recorder.step(0.0)
            self.said.append((self.clock.now_s, raw))
            self.look()
        self.left_s -= timeout_s
        return self.left_s <= 0

    def look(self):
        """All frames but those of the last half second, and a step, are there."""
        left = self.disk.after(self.folder, self.folder.with_name("after"))
        kept = raws(*(file for dive in sorted(left.iterdir()) for file in DiveFolder(dive).telemetry()))
        old = [raw for at_s, raw in self.said if at_s <= self.clock.now_s - 0.5 - STEP_S]
        assert kept[: len(old)] == old
        self.looks += bool(old)


def test_a_recorder_loses_half_a_second_at_most_when_the_power_fails(disk, tmp_path):
    (tmp_path / "dives").mkdir()
    power = Power(disk, tmp_path / "dives", 5.0)
    power.recorder.sync_until(power)
    assert power.looks > 50
    following = new_folder(tmp_path / "dives", UNIX_S + 60.0, "lake")
    power.recorder.go_on(following.open_telemetry, lambda _: None)
    power.recorder.sync()
    power.left_s = 5.0
    power.recorder.sync_until(power)
    assert len(raws(following.path / "telemetry.tlog")) > 50
    power.recorder.close()


def test_what_a_file_held_that_could_not_be_written_on_is_put_on_the_disk(disk, tmp_path, monkeypatch):
    (tmp_path / "dives").mkdir()
    power = Power(disk, tmp_path / "dives", 5.0)
    write, fails_at = os.write, iter(range(1, 1000))
    monkeypatch.setattr(
        "os.write", lambda file, data: refuse() if next(fails_at) == 37 else write(file, data)
    )

    def refuse():
        raise OSError(28, "No space left on device")

    power.recorder.sync_until(power)
    assert power.recorder.kept.files == 2
    assert power.looks > 50
    power.recorder.close()


def test_a_vehicles_own_recording_loses_half_a_second_at_most_when_its_power_fails(disk, tmp_path):
    ring, clock, encoder = tmp_path / "ring", SimulatedClock(), Encoder(1, 1)
    ring.mkdir()
    keeper = RingKeeper(RingFiles(ring, RingSize(1_000_000, 1000), 7), clock)
    said = []
    for _ in range(200):
        clock.advance_to(clock.now_s + STEP_S)
        raw = encoder.frame(30, bytes(28))
        keeper.put(round((UNIX_S + clock.now_s) * 1e6), clock.now_s, [raw])
        keeper.write_waiting()
        said.append((clock.now_s, raw))
        left = disk.after(ring, tmp_path / "after")
        kept = ring_raws(left)
        old = [raw for at_s, raw in said if at_s <= clock.now_s - 0.5 - STEP_S]
        assert kept[: len(old)] == old
    assert len(segments_in(ring)) == 5
    keeper.close()


def test_a_fetched_segment_and_a_key_are_on_the_disk_before_anybody_relies_on_them(disk, tmp_path):
    mirror, name = Mirror(tmp_path / "mirror"), "000002-0000000b-000001-0000000000.tlog"
    with mirror.locked():
        mirror.append(name, b"abc")
        mirror.finish(name)
    assert disk.bytes[mirror.path(name).stat().st_ino] == 3
    write_key(tmp_path / "key", new_key())
    assert disk.bytes[(tmp_path / "key").stat().st_ino] == 65


def test_what_a_dive_is_of_and_what_was_noted_of_it_is_on_the_disk_at_once(disk, tmp_path):
    (tmp_path / "dives").mkdir()
    dive = new_folder(tmp_path / "dives", UNIX_S, "lake")
    dive.describe(About("ruvifist.yaml", configuration="hovering"))
    dive.open_telemetry(1).sync()
    dive.add_event(UNIX_S, "leaves the harbour")
    left = disk.after(tmp_path / "dives", tmp_path / "after")
    assert DiveFolder(left / dive.path.name).about() == dive.about()


def test_the_first_receipt_of_all_is_on_the_disk_with_its_folder_before_anything_is_written(disk, tmp_path):
    home = tmp_path / "home"
    home.mkdir()
    plan = make_plan({"FF0_M_U": 24.5}, {"FF0_M_U": 10.0})
    receipt = begin(plan, (1, 1), new_preimage(home / "receipts", UNIX_S), None, UNIX_S)
    left = disk.after(home, tmp_path / "after") / "receipts"
    assert read_parameters(left / receipt.preimage.name) == {"FF0_M_U": 10.0}
    assert [kept.outcome for kept in kept_in(left)] == [Outcome.BEGUN]


def test_the_first_set_of_all_is_on_the_disk_with_its_folder_when_it_is_stored(disk, tmp_path):
    home = tmp_path / "home"
    home.mkdir()
    stored = {"hull": Stored(1.0, {"FF0_M_U": 24.5})}
    save(home / "seatrial" / "vehicle.json", stored)
    left = disk.after(home, tmp_path / "after")
    assert load(left / "seatrial" / "vehicle.json") == stored
