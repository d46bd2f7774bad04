"""Jobs on cores, on a Dask cluster and in parcels: each has one result, whatever dies."""

import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from dataclasses import replace

import batch_jobs
import pytest
from dask_cluster import cluster

from bench.stamp import files, reached
from bridge.errors import LinkLost, LinkTimeout
from bridge.vehicle.config import CONFIGS, load_vehicle
from bridge.vehicle.thrusters import thrust_curve
from identify.batch import cluster as batch_cluster
from identify.batch.cluster import pack, run_on_cluster, run_parcel, unpack
from identify.batch.code_version import PLACE, answering
from identify.batch.jobs import (
    IDENTIFY,
    definitions,
    job_for,
    own_columns,
    run_job,
    thrust_table,
)
from identify.batch.recordings import find_recordings
from identify.batch.run import run_here
from identify.estimators.table import METHODS
from identify.ingest.ros.bags import READERS

FILE = batch_jobs.FILE


def test_each_job_has_one_result_under_its_own_key_and_a_process_that_dies_costs_its_own_dive_alone(tmp_path):
    paths = batch_jobs.recordings(tmp_path / "dives", 5)
    todo = [batch_jobs.job_on(path, "die" if path is paths[1] else "size", FILE) for path in paths]
    results = list(run_here(todo, 2))
    assert Counter(r.key for r in results) == Counter(job.key for job in todo)
    (dead,) = (r for r in results if r.answer is None)
    assert dead.dive == "dive-01"
    assert "exit code 3" in dead.error
    assert not dead.final
    answers = [r.answer for r in results if r.answer is not None]
    assert {answer["bytes"] for answer in answers} == {len(b"recording 0")}
    pids = {answer["pid"] for answer in answers}
    assert len(pids) <= 3
    assert os.getpid() not in pids


def test_an_error_on_purpose_is_a_result_to_keep_and_a_defect_one_to_try_again(tmp_path):
    (path,) = batch_jobs.recordings(tmp_path / "dives", 1)
    refused = run_job(batch_jobs.job_on(path, "refuse", FILE))
    assert (refused.error, refused.final) == ("says nothing; dive again", True)
    stumbled = run_job(batch_jobs.job_on(path, "stumble", FILE))
    assert stumbled.error.startswith("ValueError: no dive-00; ")
    assert not stumbled.final


def test_closing_ends_the_processes_at_their_work(tmp_path, monkeypatch):
    first, second = batch_jobs.recordings(tmp_path / "dives", 2)
    with batch_jobs.desk(monkeypatch) as visitors:
        results = run_here(
            [batch_jobs.job_on(first, "meet", FILE), batch_jobs.job_on(second, "size", FILE)], 2
        )
        assert next(results).dive == "dive-01"
        at_work = next(visitors)
        results.close()
        at_work.leaves()
    with pytest.raises(ProcessLookupError):
        os.kill(at_work.pid, 0)


def test_control_c_is_for_the_batch_alone_and_ends_its_processes_without_a_word(tmp_path, monkeypatch):
    batch_jobs.recordings(tmp_path / "dives", 3)
    with batch_jobs.desk(monkeypatch) as visitors:
        program = subprocess.Popen(
            [sys.executable, "-c", "import sys, batch_jobs; batch_jobs.batch_of(*sys.argv[1:])",
             str(tmp_path / "dives"), "meet"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            env={**os.environ, "PYTHONPATH": batch_jobs.python_path()},
        )  # fmt: skip
        unmoved = next(visitors)
        os.kill(unmoved.pid, signal.SIGINT)
        unmoved.go_on()
        at_work = [next(visitors), next(visitors)]
        os.killpg(program.pid, signal.SIGINT)
        out, errors = program.communicate(timeout=batch_jobs.PATIENCE_S)
        for visitor in at_work:
            visitor.leaves()
    assert (out, errors, program.returncode) == (f"{unmoved.dive}\n", "", 4)


def test_a_process_that_had_loaded_numba_compiles_on_with_one_thread(monkeypatch):
    monkeypatch.delenv("NUMBA_NUM_THREADS", raising=False)
    program = (
        "import numba; numba.set_num_threads(numba.config.NUMBA_NUM_THREADS); "
        "from identify.batch.jobs import one_thread; one_thread(); "
        "print(numba.njit(lambda x: x + 1)(1), numba.get_num_threads())"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.stdout, done.returncode) == ("2 1\n", 0), done.stderr


def test_a_process_keeps_to_one_thread(tmp_path, monkeypatch):
    for name in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
        monkeypatch.delenv(name, raising=False)
    (path,) = batch_jobs.recordings(tmp_path / "dives", 1)
    (result,) = run_here([batch_jobs.job_on(path, "threads", FILE)], 1)
    assert result.answer == {"numba": 1, "torch": 1}


def cluster_jobs(paths, *functions):
    """A job for each recording; the last function is that of all further ones."""
    functions += functions[-1:] * (len(paths) - len(functions))
    return [batch_jobs.job_on(path, name, FILE) for path, name in zip(paths, functions, strict=True)]


def goes_away_after_the_first(running, tmp_path, visitors):
    """A scheduler that dies ends a batch after what was done."""
    todo = cluster_jobs(batch_jobs.recordings(tmp_path / "more", 2), "size", "meet")
    results = run_on_cluster(todo, running.address)
    assert next(results).dive == "dive-00"
    at_work = next(visitors)
    running.scheduler.kill()
    with pytest.raises(LinkLost, match="finished dives are kept"), at_work.line:
        next(results)


@pytest.mark.slow
def test_a_killed_worker_loses_nothing_nothing_counts_twice_and_a_lost_scheduler_ends_the_batch(
    tmp_path, monkeypatch
):
    todo = cluster_jobs(batch_jobs.recordings(tmp_path / "dives", 8), "size", "meet")
    with batch_jobs.desk(monkeypatch) as visitors, cluster(tmp_path, workers=2) as running:
        results = run_on_cluster(todo, running.address)
        finished = [next(results)]
        doomed, other = next(visitors), next(visitors)
        assert doomed.pid != other.pid
        doomed.kill()
        other.go_on()
        finished.append(next(results))
        seen = []
        while len(finished) < len(todo):
            visitor = next(visitors)
            seen.append(visitor.dive)
            visitor.go_on()
            finished.append(next(results))
        assert next(results, None) is None
        goes_away_after_the_first(running, tmp_path, visitors)
    assert doomed.dive in seen
    assert Counter(r.key for r in finished) == Counter(job.key for job in todo)
    assert {r.answer["pid"] for r in finished[1:]} == {other.pid}


def test_a_dive_that_kills_each_worker_is_a_row_to_try_again_and_a_scheduler_without_any_is_told(
    tmp_path, monkeypatch
):
    monkeypatch.setenv("DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES", "0")
    todo = cluster_jobs(batch_jobs.recordings(tmp_path / "dives", 1), "die")
    with cluster(tmp_path, workers=1) as running:
        (result,) = run_on_cluster(todo, running.address)
        with pytest.raises(LinkTimeout, match="has no worker"):
            list(run_on_cluster(todo, running.address, workers_within_s=0.0))
    assert "worker that took it died" in result.error
    assert not result.final


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
    (result,) = find_recordings([str(arrived.recording.path)]).recordings
    assert (result.name, result.sha256) == (job.recording.name, job.recording.sha256)
    assert arrived.recording.files == result.files
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


@pytest.mark.parametrize("ending", READERS)
def test_a_bag_arrives_with_the_definitions_beside_it_on_which_its_key_rests(tmp_path, ending):
    bag = tmp_path / f"swim{ending}"
    bag.write_bytes(b"bag")
    bare = batch_jobs.job_on(bag, "size", batch_jobs.FILE)
    definition = tmp_path / "our_msgs" / "msg" / "Dvl.msg"
    definition.parent.mkdir(parents=True)
    definition.write_text("float64 u\n")
    job = batch_jobs.job_on(bag, "size", batch_jobs.FILE)
    assert job.key != bare.key
    arrived = unpack(pack(job), tmp_path / "there")
    assert [file.read_text() for file in definitions(arrived.recording)] == ["float64 u\n"]


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
    monkeypatch.setattr(batch_cluster, "our_version", lambda: "0.0.1")
    result = run_parcel(sent)
    assert "has seatrial 0.0.1" in result.error
    assert not result.final


NOTHING_TO_ANSWER = ("__init__.py", "version.py")


def test_the_stamp_covers_every_module_that_an_identification_or_a_diagnosis_reaches():
    methods = [f"{name.replace('.', '/')}.py" for name in METHODS.values()]
    behind = {
        file
        for file in files(reached("identify/batch/dive_jobs.py", *methods))
        if file.name not in NOTHING_TO_ANSWER
    }
    assert len(behind) > 30
    assert behind <= set(answering(PLACE))


def test_a_job_of_other_code_has_another_key(tmp_path, monkeypatch):
    (path,) = batch_jobs.recordings(tmp_path / "dives", 1)
    job = batch_jobs.job_on(path, "size", batch_jobs.FILE)
    assert batch_jobs.job_on(path, "size", batch_jobs.FILE) == job
    monkeypatch.setattr("identify.batch.jobs.our_version", lambda: "0.1.0, code 0123456789")
    other = batch_jobs.job_on(path, "size", batch_jobs.FILE)
    assert other.key != job.key
    assert replace(other, key=job.key) == job
