"""A command in a process of its own: its lines without waiting, and an end that is one."""

import json
import multiprocessing
import os
import select
import threading
import time
from functools import partial
from pathlib import Path

import pytest
from jobs_at_work import chatty, refuse, square

from bridge.clock import SimulatedClock
from bridge.errors import ConfigError, FitError
from bridge.reports import ERROR, Report, line
from gcs_plugin import job as jobs
from gcs_plugin.job import Job, side_by_side
from gcs_plugin.mavproxy.work import Work

DEADLINE_S = 60.0


def run(code, now_s=0.0):
    return Job("a test", ["-u", "-c", code], now_s, {"SAID": "hello"})


def lines_until(job, done, now_s=0.0):
    """Its lines until `done(lines)`, waiting for output and never for time."""
    lines, end_s = [], time.monotonic() + DEADLINE_S
    while not done(lines):
        assert time.monotonic() < end_s, lines
        if job.code is None:
            select.select([job._out], [], [], 0.2)
        lines += job.lines(now_s)
    return lines


def gone(pid):
    """Whether a process is no more, or is only waited for."""
    try:
        with open(f"/proc/{pid}/stat", encoding="ascii") as file:
            return file.read().rpartition(")")[2].split()[0] == "Z"
    except FileNotFoundError:
        return True


def test_lines_come_whole_and_the_code_after_the_last():
    job = run(
        "import os,sys; print(os.environ['SAID']); print('oh', file=sys.stderr); print('end', end=''); sys.exit(3)"
    )
    lines = lines_until(job, lambda _: job.code is not None)
    assert sorted(lines) == ["end", "hello", "oh"]
    assert job.code == 3
    assert job.lines(1.0) == []


def test_the_last_words_of_a_command_that_ends_just_after_its_pipe_was_found_empty_are_heard(
    tmp_path, monkeypatch
):
    go = tmp_path / "go"
    os.mkfifo(go)
    job, read = run(f"open({str(go)!r}).read(); print('why it failed')"), os.read

    def found_empty(file, size):
        monkeypatch.undo()
        with pytest.raises(BlockingIOError):
            read(file, size)
        go.write_text("")
        job._process.wait(DEADLINE_S)
        raise BlockingIOError

    monkeypatch.setattr(jobs.os, "read", found_empty)
    assert lines_until(job, lambda _: job.code is not None) == ["why it failed"]


def test_nothing_is_waited_for_while_it_says_nothing():
    job = run("import time; time.sleep(60)")
    assert job.lines(0.0) == []
    assert job.code is None
    job.kill()
    assert job.code is not None


def test_cancel_asks_as_ctrl_c_does():
    # A program that was started in the background would ignore Ctrl-C from its start; and one long sleep does not end
    # by a signal that comes just before it begins.
    job = run(
        "import signal, time\nsignal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "try:\n    print('up')\n    while True:\n        time.sleep(0.01)\n"
        "except KeyboardInterrupt:\n    raise SystemExit(4)"
    )
    lines_until(job, lambda lines: "up" in lines)
    job.cancel(0.0)
    lines_until(job, lambda _: job.code is not None)
    assert (job.code, job.cancelled) == (4, True)


def test_what_does_not_listen_is_ended_with_all_its_workers():
    job = run(
        "import os, signal, time\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\n"
        "child = os.fork()\nif child:\n    print(child)\ntime.sleep(60)"
    )
    (worker,) = lines_until(job, lambda lines: bool(lines))
    job.cancel(10.0)
    job.lines(14.9)
    assert job.code is None
    lines_until(job, lambda _: job.code is not None and gone(int(worker)), 15.0)
    assert not os.path.exists(f"/proc/{job._process.pid}")


def test_a_worker_that_holds_the_pipe_open_holds_nobody_up():
    job = run("import os, time\nchild = os.fork()\nif child:\n    print(child)\nelse:\n    time.sleep(60)")
    (worker,) = lines_until(job, lambda _: job.code is not None)
    assert job.code == 0
    os.kill(int(worker), 9)


def test_the_command_is_this_pythons_own_in_any_folder(tmp_path, monkeypatch):
    (tmp_path / "tui").mkdir()
    (tmp_path / "tui" / "__main__.py").write_text("print('another')")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(Path(jobs.__file__).resolve().parents[1]))
    job = Job("a test", ["-m", "tui", "--version"], 0.0)
    (line,) = lines_until(job, lambda _: job.code is not None)
    assert line.startswith("seatrial ")


@pytest.mark.parametrize(
    ("function", "options", "why"),
    [
        ("identify", ["--accept", "x.param"], "in a terminal `seatrial identify` has more options"),
        ("diagnose", ["--method", "pinn"], "in a terminal `seatrial diagnose` has more options"),
        ("identify", ["--method"], "--method"),
    ],
)
def test_an_option_that_mavproxy_does_not_take_is_refused_with_the_way_to_more(
    function, options, why, tmp_path
):
    work = Work(SimulatedClock(), lambda _: None)
    with pytest.raises(ConfigError, match=why):
        work.begin(function, tmp_path, options, "ruvifist")
    assert work.status() == []


class Refused:
    """A job that has come far, and then could not tell anything."""

    title, began_s, code, cancelled = "identify", 0.0, 1, False

    def __init__(self, *_):
        self._said = [Report("likelihood", 0.5, "pass 3"), Report(ERROR, 1.0, "dive: no thruster pushed")]

    def lines(self, _now_s):
        said, self._said = self._said, []
        return [line(report) for report in said]


def test_the_answer_of_an_earlier_run_is_not_said_again_where_a_newer_one_has_none(tmp_path, monkeypatch):
    monkeypatch.setattr("gcs_plugin.mavproxy.work.Job", Refused)
    answer = {
        "dive": {"name": "dive"},
        "method": "likelihood",
        "configuration": "hovering",
        "outcome": "converged",
    }
    (tmp_path / "identified.json").write_text(
        json.dumps(answer | {"parameters": [], "doubts": [], "notes": []})
    )
    (tmp_path / "identified.param").write_text("FF1_M_U,1\n")
    said = []
    work = Work(SimulatedClock(), said.append)
    work.begin("identify", tmp_path, [], "ruvifist:hovering")
    work.tick()
    assert said[1:] == [
        "likelihood: pass 3 (50%)",
        "seatrial: dive: no thruster pushed",
        "identify: done, and there is something to read before its values are used, after 0 s",
    ]


def test_each_result_comes_back_under_its_own_name_from_another_process():
    heard = []
    result = side_by_side(
        {"a": partial(square, 3), "b": partial(square, 4)}, lambda done: heard.append(dict(done))
    )
    assert {name: value for name, (value, _) in result.items()} == {"a": 9, "b": 16}
    assert os.getpid() not in {process for _, process in result.values()}
    assert heard[0] == {"a": 0.0, "b": 0.0}


def test_a_job_that_has_told_more_than_anybody_read_ends_all_the_same():
    work = {"a": partial(chatty, 20_000)}
    at_work = threading.Thread(target=side_by_side, args=(work, lambda _: None), daemon=True)
    at_work.start()
    at_work.join(DEADLINE_S)
    is_over = not at_work.is_alive()
    for process in multiprocessing.active_children():
        process.kill()
    assert is_over


def test_the_error_of_a_job_reaches_the_one_that_waits():
    with pytest.raises(FitError, match="record the DVL"):
        side_by_side({"a": refuse}, lambda _: None)
