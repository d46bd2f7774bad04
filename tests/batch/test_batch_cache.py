"""A batch's cache: an interrupted batch goes on, and nothing is done or counted twice."""

from dataclasses import replace
from types import SimpleNamespace

import batch_jobs
import numpy as np
import pytest

from bridge.errors import LinkLost, LogError
from identify.batch import dive_jobs
from identify.batch.jobs import IDENTIFY, Result, run_job
from identify.batch.run import Cache, Standing, run_batch
from identify.dive import Signal


@pytest.fixture
def jobs(tmp_path):
    paths = batch_jobs.recordings(tmp_path / "dives", 4)
    return [batch_jobs.job_on(path, "size", batch_jobs.FILE) for path in paths]


@pytest.fixture
def open_cache(tmp_path):
    opened = []

    def open_():
        opened.append(Cache(tmp_path / "out" / "results.jsonl"))
        return opened[-1]

    yield open_
    for cache in opened:
        cache.close()


class Engine:
    """Does jobs here and now; `stop_before` ends it as a lost scheduler would."""

    def __init__(self, stop_before=None):
        self.stop_before = stop_before
        self.done = []

    def __call__(self, jobs):
        for number, job in enumerate(jobs):
            if number == self.stop_before:
                raise LinkLost("gone")
            self.done.append(job.key)
            yield run_job(job)


def test_a_batch_that_was_stopped_goes_on_with_what_is_left(jobs, open_cache):
    first, second = Engine(stop_before=2), Engine()
    with pytest.raises(LinkLost):
        run_batch(jobs, open_cache(), first, lambda _: None)
    results = run_batch(jobs, open_cache(), second, lambda _: None)
    assert len(first.done) == 2
    assert sorted(first.done + second.done) == sorted(job.key for job in jobs)
    assert sorted(r.key for r in results) == sorted(job.key for job in jobs)
    assert all(r.answer for r in results)


def test_a_result_that_was_cut_while_it_was_written_is_done_again_and_costs_no_other(jobs, open_cache):
    cache = open_cache()
    run_batch(jobs[:2], cache, Engine(), lambda _: None)
    cache.path.write_bytes(b'[1]\n{"key": "a"}\nnonsense\n\n' + cache.path.read_bytes()[:-20])
    again = Engine()
    results = run_batch(jobs, open_cache(), again, lambda _: None)
    assert len(results) == 4
    assert again.done == [jobs[1].key, jobs[2].key, jobs[3].key]
    assert len(open_cache()) == 4


def test_a_failure_that_may_pass_is_not_kept(open_cache):
    cache = open_cache()
    cache.add(Result("a", "dive", "dive.tlog", "0", None, "killed", final=False))
    cache.add(Result("b", "dive", "dive.tlog", "0", None, "too short", final=True))
    assert open_cache().get("a") is None
    assert open_cache().get("b").error == "too short"


def test_a_recording_that_moved_keeps_its_result_under_its_new_name(jobs, open_cache, tmp_path):
    run_batch(jobs, open_cache(), Engine(), lambda _: None)
    moved = tmp_path / "moved.tlog"
    jobs[0].recording.path.rename(moved)
    job = batch_jobs.job_on(moved, "size", batch_jobs.FILE)
    idle = Engine()
    (result,) = run_batch([job], open_cache(), idle, lambda _: None)
    assert (result.dive, result.source, idle.done) == ("moved", str(moved), [])


def test_the_standing_counts_what_is_kept_done_and_failed(jobs, open_cache):
    cache = open_cache()
    run_batch(jobs[:1], cache, Engine(), lambda _: None)
    bad = batch_jobs.job_on(jobs[1].recording.path, "refuse", batch_jobs.FILE)
    reports = []
    run_batch([jobs[0], bad, jobs[2]], cache, Engine(), reports.append)
    assert reports == [Standing(3, 1, 0, 0), Standing(3, 1, 1, 1), Standing(3, 1, 2, 1)]
    assert reports[1].share == pytest.approx(2 / 3)
    assert (reports[0].time_left_s(5.0), Standing(10, 4, 2, 0).time_left_s(20.0)) == (None, 40.0)


def test_a_place_that_can_not_be_written_is_one_sentence(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(LogError, match="give another folder with --out"):
        Cache(tmp_path / "file" / "results.jsonl")


def test_a_recording_is_done_again_once_its_name_has_a_date_and_not_for_any_other_name(tmp_path):
    (path,) = batch_jobs.recordings(tmp_path / "dives", 1)
    before = batch_jobs.job_on(path, "size", batch_jobs.FILE).key
    renamed = path.rename(path.with_name("quay.tlog"))
    assert batch_jobs.job_on(renamed, "size", batch_jobs.FILE).key == before
    dated = renamed.rename(path.with_name("2026-11-20-quay.tlog"))
    assert batch_jobs.job_on(dated, "size", batch_jobs.FILE).key != before


def test_an_infinite_voltage_of_a_damaged_log_leaves_a_result_that_can_be_kept(monkeypatch, jobs, open_cache):
    voltage = Signal(np.arange(3.0), np.array([[15.0], [np.inf], [17.0]]))
    dive = SimpleNamespace(voltage=voltage, unix_at_boot_s=1.77e9, span_s=(0.0, 2.0))
    answer = SimpleNamespace(answer=SimpleNamespace(to_json=dict))
    monkeypatch.setattr(dive_jobs, "read_job", lambda _: (dive, batch_jobs.FILE, "hovering"))
    monkeypatch.setattr(dive_jobs.run_identify, "identify", lambda *_: answer)
    result = run_job(replace(jobs[0], function=IDENTIFY))
    open_cache().add(result)
    assert result.answer["voltage_v"] == 16.0
    assert open_cache().get(result.key) == result


def test_an_answer_that_holds_no_number_costs_its_dive_alone(jobs, open_cache):
    nothing = replace(jobs[0], function="batch_jobs:know_nothing", key="nothing")
    results = run_batch([nothing, *jobs[1:]], open_cache(), Engine(), lambda _: None)
    assert [bool(result.answer) for result in results] == [False, True, True, True]
    assert "the code did not expect this recording" in results[0].error
