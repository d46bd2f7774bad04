"""Jobs on a real Dask cluster on loopback: workers and schedulers die, and each job has one result."""

import socket
from collections import Counter

import batch_jobs
import pytest
from dask_cluster import cluster

from bridge.errors import LinkLost, LinkTimeout
from identify.batch.cluster import run_on_cluster

FILE = batch_jobs.FILE


def jobs(paths, *functions):
    """One job a recording; the last function is that of all the rest."""
    named = [functions[min(number, len(functions) - 1)] for number in range(len(paths))]
    return [batch_jobs.job_on(path, name, FILE) for path, name in zip(paths, named, strict=True)]


@pytest.mark.slow
def test_a_worker_killed_at_its_work_loses_nothing_and_nothing_counts_twice(tmp_path, monkeypatch):
    todo = jobs(batch_jobs.recordings(tmp_path / "dives", 8), "size", "meet")
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
    assert doomed.dive in seen
    assert Counter(r.key for r in finished) == Counter(job.key for job in todo)
    assert {r.answer["pid"] for r in finished[1:]} == {other.pid}


def test_a_dive_that_kills_each_worker_that_takes_it_is_a_row_to_try_again(tmp_path, monkeypatch):
    monkeypatch.setenv("DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES", "0")
    todo = jobs(batch_jobs.recordings(tmp_path / "dives", 1), "die")
    with cluster(tmp_path, workers=1) as running:
        (result,) = run_on_cluster(todo, running.address)
    assert "worker that took it died" in result.error
    assert not result.final


def test_errors_of_a_worker_name_the_files_of_who_sent_them(tmp_path):
    paths = batch_jobs.recordings(tmp_path / "dives", 2)
    todo = jobs(paths, "refuse", "no_such_function")
    with cluster(tmp_path, workers=1) as running:
        results = {r.dive: r for r in run_on_cluster(todo, running.address)}
    assert results["dive-00"].error == "says nothing; dive again"
    assert results["dive-00"].final
    assert "no_such_function" in results["dive-01"].error


def test_nobody_at_the_address_is_told_in_one_sentence(tmp_path):
    todo = jobs(batch_jobs.recordings(tmp_path / "dives", 1), "size")
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    with pytest.raises(LinkTimeout, match="no Dask scheduler answers there"):
        list(run_on_cluster(todo, f"tcp://127.0.0.1:{port}", answer_within_s=0.5))


def test_a_scheduler_without_workers_is_told_after_a_while(tmp_path):
    todo = jobs(batch_jobs.recordings(tmp_path / "dives", 1), "size")
    with cluster(tmp_path, workers=0) as running, pytest.raises(LinkTimeout, match="has no worker"):
        list(run_on_cluster(todo, running.address, workers_within_s=0.0))


def test_a_scheduler_that_goes_away_ends_the_batch_after_what_was_done(tmp_path, monkeypatch):
    todo = jobs(batch_jobs.recordings(tmp_path / "dives", 2), "size", "meet")
    with batch_jobs.desk(monkeypatch) as visitors, cluster(tmp_path, workers=1) as running:
        results = run_on_cluster(todo, running.address)
        assert next(results).dive == "dive-00"
        at_work = next(visitors)
        running.scheduler.kill()
        with pytest.raises(LinkLost, match="finished dives are kept"), at_work.line:
            next(results)
