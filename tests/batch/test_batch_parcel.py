"""Parcels: a job arrives on another computer with all that it reads, and nothing stays behind there."""

import shutil
import tempfile
from dataclasses import replace

import batch_jobs
import pytest

from bridge.vehicle.config import CONFIGS, load_vehicle
from bridge.vehicle.thrusters import thrust_curve
from identify.batch import cluster
from identify.batch.cluster import pack, run_parcel, unpack
from identify.batch.jobs import IDENTIFY, job_for, own_columns, thrust_table
from identify.batch.recordings import find_recordings


@pytest.fixture
def own_vehicle(tmp_path):
    """A vehicle file whose thrust table lies in a folder beside it."""
    home = tmp_path / "own"
    (home / "tables").mkdir(parents=True)
    shutil.copy(CONFIGS / "thrusters" / "t200.csv", home / "tables" / "mine.csv")
    text = (CONFIGS / "vehicles" / "bluerov2_heavy.yaml").read_text(encoding="utf-8")
    (home / "own.yaml").write_text(text, encoding="utf-8")
    file = load_vehicle(str(home / "own.yaml"))
    curve = replace(file.vehicle.thrust_curve, kind="table", file="tables/mine.csv")
    return replace(file, vehicle=replace(file.vehicle, thrust_curve=curve))


@pytest.fixture
def folder(tmp_path):
    """A dive folder of two recordings."""
    dive = tmp_path / "dives" / "2026-11-20T0912Z-lake"
    dive.mkdir(parents=True)
    (dive / "telemetry.tlog").write_bytes(b"first")
    (dive / "telemetry.2.tlog").write_bytes(b"second")
    return dive


def test_a_dive_folder_arrives_with_the_vehicle_and_its_table(folder, own_vehicle, tmp_path):
    job = batch_jobs.job_on(folder, "size", own_vehicle)
    arrived = unpack(pack(job), tmp_path / "there")
    shutil.rmtree(folder)
    shutil.rmtree(own_vehicle.path.parent)
    (found,) = find_recordings([str(arrived.recording.path)]).recordings
    assert (found.name, found.sha256) == (job.recording.name, job.recording.sha256)
    assert arrived.recording.files == found.files
    assert thrust_table(arrived.vehicle).is_relative_to(tmp_path / "there")
    assert thrust_curve(arrived.vehicle.vehicle.thrust_curve, arrived.vehicle.path.parent).max_n > 0
    assert arrived.key == job.key


def test_a_table_arrives_with_the_column_map_of_its_folder_or_of_the_command(tmp_path):
    dive = tmp_path / "lake"
    dive.mkdir()
    (dive / "telemetry.csv").write_text("t\n1\n")
    (dive / "columns.yaml").write_text("time: t\n")
    arrived = unpack(pack(batch_jobs.job_on(dive, "size", batch_jobs.FILE)), tmp_path / "there")
    assert own_columns(arrived.recording).read_text() == "time: t\n"
    other = tmp_path / "map.yaml"
    other.write_text("time: u\n")
    (recording,) = find_recordings([str(dive / "telemetry.csv")]).recordings
    job = job_for("batch_jobs:size", recording, batch_jobs.FILE, "likelihood", other)
    assert unpack(pack(job), tmp_path / "elsewhere").columns.read_text() == "time: u\n"


def test_nothing_stays_where_a_parcel_was_done_and_errors_name_the_senders_files(
    folder, tmp_path, monkeypatch
):
    (tmp_path / "scratch").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "scratch"))
    sent = pack(batch_jobs.job_on(folder, "size", batch_jobs.FILE))
    assert run_parcel(sent).answer["bytes"] == len(b"firstsecond")
    unreadable = pack(replace(batch_jobs.job_on(folder, "size", batch_jobs.FILE), function=IDENTIFY))
    error = run_parcel(unreadable).error
    assert str(folder) in error
    assert "scratch" not in error
    assert not list((tmp_path / "scratch").iterdir())


def test_a_worker_of_another_version_refuses_and_says_so(folder, monkeypatch):
    sent = pack(batch_jobs.job_on(folder, "size", batch_jobs.FILE))
    monkeypatch.setattr(cluster, "our_version", lambda: "0.0.1")
    result = run_parcel(sent)
    assert "has seatrial 0.0.1" in result.error
    assert not result.final
