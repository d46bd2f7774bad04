"""Jobs on this computer's cores: each has one result, whatever becomes of the others."""

import os
import signal
import subprocess
import sys
from collections import Counter

import batch_jobs
import pytest

from identify.batch.jobs import run_job
from identify.batch.local import run_here

FILE = batch_jobs.FILE


def jobs(paths, function):
    return [batch_jobs.job_on(path, function, FILE) for path in paths]


def test_each_job_has_one_result_under_its_own_key(tmp_path):
    todo = jobs(batch_jobs.recordings(tmp_path / "dives", 5), "size")
    results = list(run_here(todo, 2))
    assert Counter(r.key for r in results) == Counter(job.key for job in todo)
    assert {r.answer["bytes"] for r in results} == {len(b"recording 0")}
    assert len({r.answer["pid"] for r in results}) <= 2
    assert os.getpid() not in {r.answer["pid"] for r in results}


def test_jobs_are_taken_only_as_processes_become_free(tmp_path):
    taken = []

    def todo():
        for job in jobs(batch_jobs.recordings(tmp_path / "dives", 6), "size"):
            taken.append(job)
            yield job

    results = run_here(todo(), 2)
    next(results)
    assert len(taken) <= 3
    results.close()


def test_an_error_on_purpose_is_a_result_to_keep_and_a_defect_one_to_try_again(tmp_path):
    (path,) = batch_jobs.recordings(tmp_path / "dives", 1)
    refused = run_job(batch_jobs.job_on(path, "refuse", FILE))
    assert (refused.error, refused.final) == ("says nothing; dive again", True)
    stumbled = run_job(batch_jobs.job_on(path, "stumble", FILE))
    assert stumbled.error.startswith("ValueError: no dive-00; ")
    assert not stumbled.final


def test_a_process_that_dies_costs_its_own_dive_alone(tmp_path):
    paths = batch_jobs.recordings(tmp_path / "dives", 4)
    todo = [batch_jobs.job_on(path, "die" if path is paths[1] else "size", FILE) for path in paths]
    results = {r.dive: r for r in run_here(todo, 2)}
    assert sorted(name for name, r in results.items() if r.answer is not None) == [
        "dive-00", "dive-02", "dive-03",
    ]  # fmt: skip
    assert "exit code 3" in results["dive-01"].error
    assert not results["dive-01"].final


def test_a_killed_process_is_told_as_one(tmp_path, monkeypatch):
    first, second = batch_jobs.recordings(tmp_path / "dives", 2)
    with batch_jobs.desk(monkeypatch) as visitors:

        def todo():
            yield batch_jobs.job_on(first, "meet", FILE)
            next(visitors).kill()
            yield batch_jobs.job_on(second, "size", FILE)

        results = {r.dive: r for r in run_here(todo(), 2)}
    assert "was killed" in results["dive-00"].error
    assert results["dive-01"].answer is not None


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
