"""A verb in a process of its own: its progress is heard, its result is read, and cancelling it ends it."""

import asyncio
import json
import os
import subprocess

import pytest
from soak import rest_in_soak

from bridge import exit_codes
from bridge.reports import FORM, VARIABLE, Report, Written, line, read
from identify.challenge.case import dive_of, draw_case
from identify.challenge.tlog import tlog_of
from tui import show
from tui.app.jobs import Jobs, work


@pytest.fixture(scope="module", params=rest_in_soak((45.0, 100.0)))
def dive(tmp_path_factory, request):
    """The words that identify a short dive without a hidden effect."""
    return identifying(tmp_path_factory.mktemp("dive"), request.param)


def identifying(folder, seconds):
    """The words that identify a dive without a hidden effect, which is written into a folder."""
    case = draw_case(300_001, kind="none", seconds=seconds)
    (folder / "dive.tlog").write_bytes(tlog_of(dive_of(case)))
    (folder / "vehicle.yaml").write_text(case.vehicle.text, encoding="utf-8")
    vehicle = f"{folder / 'vehicle.yaml'}:{case.configuration}"
    return ("identify", str(folder / "dive.tlog"), "--vehicle", vehicle)


def ran(*words):
    heard: list[Report] = []
    return asyncio.run(work(words, heard.append, lambda: 0)), heard


def test_what_a_program_is_told_it_reads_back():
    for report in (
        Report("pinn", 0.25, "pass 2", values={"M_u": (110.5, 3.1), "D_r": (-0.02, 1e-5)}),
        Report("pinn", 1.0, "answered", answered=True),
        Report(
            "writing", 0.5, "M_U", stage="STAGE", written=Written("FF1_M_U", "applied", "read back equal")
        ),
        Report("unkept", 1.0, "the disk is full", result={"a": [1, None]}),
    ):
        assert read(line(report)) == report


@pytest.mark.parametrize("text", ["", "seatrial: no such dive", "[1, 2]", '{"of": "x"}', "{"])
def test_a_line_that_is_no_progress_is_none(text):
    assert read(text) is None


def test_progress_is_lines_of_json_for_who_asks_for_them(monkeypatch, capsys):
    monkeypatch.setenv(VARIABLE, FORM)
    with show.progress("diving") as tell:
        tell(0.5, "half of it")
    assert read(capsys.readouterr().err) == Report("diving", 0.5, "half of it")


def test_an_identification_tells_its_values_as_they_converge(dive):
    done, heard = ran(*dive, "--method", "pinn")
    assert done.code in (exit_codes.DONE, exit_codes.NO)
    passes = [report.values for report in heard if report.values]
    assert len(passes) > 2
    final = {p["name"]: p["value"] for p in done.result["parameters"]}
    last = passes[-1]
    assert last
    for name, (value, half) in last.items():
        assert abs(value - final[name]) < half


def test_a_verb_that_fails_says_why_and_has_no_json(tmp_path):
    done, heard = ran("identify", str(tmp_path / "none.tlog"), "--vehicle", "ruvifist:survey")
    assert done.code == exit_codes.BAD_INPUT
    assert done.result is None
    assert not heard
    assert "none.tlog" in done.why
    assert done.error_names == ("LogError",)
    assert done.said == ()


def test_a_result_lies_where_the_words_want_it_and_an_older_one_is_nobodys(tmp_path):
    target = tmp_path / "dives.json"
    target.write_text("{}", encoding="utf-8")
    done, _ = ran("dives", str(tmp_path / "none"), "--json", str(target))
    assert (done.code, done.result) == (exit_codes.BAD_INPUT, None)
    done, _ = ran("dives", str(tmp_path), "--json", str(target))
    assert (done.code, done.result) == (exit_codes.DONE, [])
    assert json.loads(target.read_text(encoding="utf-8")) == []


class AtWork:
    """A process that runs until it is cancelled."""

    def __init__(self, *_, **__):
        self.code, self.cancelled = None, False

    def lines(self, _now_s):
        self.code = 4 if self.cancelled else None
        return []

    def cancel(self, _now_s):
        self.cancelled = True


@pytest.mark.parametrize(
    ("words", "ordered", "ends"),
    [
        (("params", "upload", "a.param", "--yes"), False, False),
        (("calibrate", "--armed"), False, False),
        (("identify", "dives/a"), False, True),
        (("ff", "both", "--yes"), True, True),
    ],
)
def test_what_was_confirmed_goes_on_without_the_app_as_in_a_browser_that_is_closed(
    words, ordered, ends, monkeypatch
):
    made = []
    monkeypatch.setattr("tui.app.jobs.Job", lambda *_, **__: made.append(AtWork()) or made[0])

    async def leave():
        jobs = Jobs()
        jobs.start("it", words)
        while not made:
            await asyncio.sleep(0)
        if ordered:
            jobs.cancel("it")
            while jobs.runs("it"):
                await asyncio.sleep(0)

    asyncio.run(leave())
    assert made[0].cancelled is ends


def test_two_presses_of_the_end_key_at_once_are_passed_on_one_after_the_other(monkeypatch):
    done = []

    class Flies(AtWork):
        def interrupt(self):
            done.append("pressed")

        def lines(self, _now_s):
            done.append("looked")
            self.code = 0 if len(done) > 5 else None
            return []

    presses = iter([2])
    monkeypatch.setattr("tui.app.jobs.Job", Flies)
    monkeypatch.setattr("tui.app.jobs.LOOK_EVERY_S", 0.0)
    asyncio.run(work(("fly", "--armed"), lambda _: None, lambda: next(presses, 0)))
    assert done[:4] == ["pressed", "looked", "pressed", "looked"]
    assert done.count("pressed") == 2


def test_cancelling_ends_the_process_and_leaves_no_file(tmp_path, monkeypatch):
    # The slow method: a busy machine may come to read its first report seconds late.
    words = (*identifying(tmp_path, 300.0), "--method", "pinn")
    started: list[subprocess.Popen[bytes]] = []
    start = subprocess.Popen

    def noted(*words, **options):
        started.append(start(*words, **options))  # type: ignore[call-overload]
        return started[-1]

    monkeypatch.setattr("gcs_plugin.job.subprocess.Popen", noted)
    page = tmp_path / "report.html"

    async def cancelled():
        heard = asyncio.Event()
        job = asyncio.create_task(work((*words, "--report", str(page)), lambda _: heard.set(), lambda: 0))
        await heard.wait()
        job.cancel()
        with pytest.raises(asyncio.CancelledError):
            await job

    asyncio.run(cancelled())
    assert started[0].returncode is not None
    with pytest.raises(ProcessLookupError):
        os.killpg(started[0].pid, 0)
    assert not page.exists()


def test_a_result_that_was_cut_off_is_none(tmp_path):
    from tui.app.jobs import json_in

    (tmp_path / "r.json").write_text(json.dumps({"a": 1})[:-1], encoding="utf-8")
    assert json_in(tmp_path / "r.json") is None
