"""The page of the benchmark: sections, stamps, results that survive a kill, and their tables."""

import contextlib
import math
import resource
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from bench import __main__ as command
from bench import document
from bench import stamp as stamps
from bench.accuracy import section as accuracy
from bench.accuracy import shorter_recordings
from bench.accuracy.answers import answered
from bench.accuracy.trials import Stated, Trial
from bench.baselines import closed_form
from bench.campaigns import Dived
from bench.diagnosis import power
from bench.document import HEAD, OLDER, Section, compared, read, written
from bench.missions.mission import draw_one
from bench.remembered import Remembered, pack
from bench.reproduce.paper import TrainingCurves
from bench.sections import SECTIONS, Measurement, Run
from bench.speed.reading import CAREFUL, OURS, THEIRS, measured
from bench.stamp import Reached, files
from bench.tracking.section import truly
from bench.tracking.steady import steady_errors
from bench.words import percent
from bridge.errors import LogError
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.legs import Leg
from bridge.wire.framing import Encoder
from identify.dive import Dive, Signal
from identify.estimators.table import SIDE_BY_SIDE
from identify.statistics import Z95


def test_one_section_is_replaced_and_the_others_stay():
    order = ("a", "b", "c")
    page = written({"c": Section("## C\nold", "12"), "a": Section("## A", "34")}, order)
    assert page.startswith(HEAD)
    assert read(page) == {"a": Section("## A", "34"), "c": Section("## C\nold", "12")}
    again = read(written({**read(page), "c": Section("## C\nnew", "56")}, order))
    assert again == {"a": Section("## A", "34"), "c": Section("## C\nnew", "56")}


def test_a_section_of_older_code_says_so_and_one_measured_anew_no_longer():
    page = written(
        compared({"a": Section("## A", "old"), "b": Section("## B", "new")}, {"a": "x", "b": "new"}),
        ("a", "b"),
    )
    assert f"<!-- section: a; code: old; seconds: 0 -->\n{OLDER}## A" in page
    assert page.count(OLDER) == 1
    assert read(page)["a"] == Section("## A", "old", older=True)
    assert OLDER not in written(compared(read(page), {"a": "old", "b": "new"}), ("a", "b"))


def made_of(*sources):
    return SimpleNamespace(SOURCES=sources)


def test_the_command_marks_what_it_measures_and_labels_what_it_leaves(tmp_path, monkeypatch):
    def page(_run):
        return "## New"

    for name in ("docs", "bench"):
        (tmp_path / name).mkdir()
    target = tmp_path / "docs" / "benchmarks.md"
    target.write_text(written({"left": Section("## Left", "0ld")}, ("left",)), encoding="utf-8")
    both = {name: Measurement(made_of(f"bench/{name}.py"), page) for name in ("left", "asked")}
    monkeypatch.setattr(command, "SECTIONS", both)
    monkeypatch.setattr(command, "ROOT", tmp_path)
    monkeypatch.setattr(sys, "argv", ["bench", "asked"])
    command.main()
    sections = read(target.read_text(encoding="utf-8"))
    assert sections == {
        "left": Section("## Left", "0ld", older=True),
        "asked": Section("## New", both["asked"].code, wall_s=0.0),
    }


def test_a_section_whose_code_changes_while_it_is_measured_is_older(tmp_path, monkeypatch):
    (tmp_path / "docs").mkdir()
    code = tmp_path / "code.py"
    code.write_text("A = 1\n", encoding="utf-8")

    def page(_run):
        code.write_text("A = 2\n", encoding="utf-8")
        return "## A"

    monkeypatch.setattr(stamps, "ROOT", tmp_path)
    stamps.stamp.cache_clear()
    monkeypatch.setattr(command, "SECTIONS", {"a": Measurement(made_of("code.py"), page)})
    monkeypatch.setattr(command, "ROOT", tmp_path)
    monkeypatch.setattr(sys, "argv", ["bench", "a"])
    command.main()
    stamps.stamp.cache_clear()
    assert read((tmp_path / "docs" / "benchmarks.md").read_text(encoding="utf-8"))["a"].older


@contextlib.contextmanager
def full_disk():
    """No file grows beyond some bytes."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (16, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_a_page_and_packed_rows_that_no_disk_takes_stay_as_they_were(tmp_path, monkeypatch):
    (tmp_path / "docs").mkdir()
    target, packed = tmp_path / "docs" / "benchmarks.md", tmp_path / "rows.jsonl.gz"
    target.write_text(written({"a": Section("## A", "0ld")}, ("a",)), encoding="utf-8")
    pack([{"a": 1}], packed)
    before = target.read_bytes(), packed.read_bytes()
    monkeypatch.setattr(
        command, "SECTIONS", {"a": Measurement(made_of("bench/words.py"), lambda _: "## New")}
    )
    monkeypatch.setattr(command, "ROOT", tmp_path)
    monkeypatch.setattr(command, "timed", lambda *_: contextlib.nullcontext())
    monkeypatch.setattr(sys, "argv", ["bench", "a"])
    with full_disk(), pytest.raises(OSError, match="File too large"):
        command.main()
    with full_disk(), pytest.raises(OSError, match="File too large"):
        pack([{"a": 2}], packed)
    assert (target.read_bytes(), packed.read_bytes()) == before


def test_times_of_sections_are_kept_in_their_marks_and_added_up_at_the_top():
    page = written(
        {
            "a": Section("## A", "12", wall_s=1800.0),
            "b": Section("## B", "34", wall_s=240.0),
            "c": Section("## C", "56", wall_s=9999.0, asked=True),
        },
        ("a", "b", "c"),
    )
    assert "<!-- section: a; code: 12; seconds: 1800 -->\n## A" in page
    assert "<!-- section: c; code: 56; seconds: 9999; asked -->\n## C" in page
    head = " ".join(page.split("<!--")[0].split())
    assert "`make bench` took 34 min of wall time, the runs of its sections added up (a 30.0, b 4.0)" in head
    assert head.endswith("Goal: within 90 min: met. No part of it, and run by name alone: c.")
    assert "by name alone" not in written({"a": Section("## A", "12")}, ("a",))
    assert read(page)["c"] == Section("## C", "56", wall_s=9999.0, asked=True)


def test_the_time_of_a_section_adds_up_over_the_runs_of_one_code(tmp_path, monkeypatch):
    clock = iter((0.0, 30.0, 100.0, 112.4, 200.0, 200.6))
    monkeypatch.setattr(document.time, "perf_counter", lambda: next(clock))
    with pytest.raises(KeyboardInterrupt), document.timed(tmp_path, "a", "12"):
        raise KeyboardInterrupt
    with document.timed(tmp_path, "a", "12"):
        pass
    with document.timed(tmp_path, "a", "34"):
        pass
    assert document.wall_s(tmp_path, "a", "12") == 42.0
    assert document.wall_s(tmp_path, "a", "34") == 1.0
    assert document.wall_s(tmp_path, "b", "12") == 0.0


@pytest.mark.parametrize("name", SECTIONS)
def test_every_sections_sources_are_there(name):
    for source in SECTIONS[name].sources:
        for pattern in source.modules if isinstance(source, Reached) else [source]:
            assert files(pattern), pattern


@pytest.mark.parametrize(("name", "module"), [("accuracy", accuracy), ("power", power)])
def test_a_short_run_leaves_the_packed_rows_of_the_full_one(name, module, tmp_path, monkeypatch):
    packed = []
    monkeypatch.setattr(module, "section", lambda *given: packed.extend(given) or "")
    for short in (False, True):
        SECTIONS[name].page(Run(tmp_path / "runs", tmp_path / "docs", tmp_path / "results", short))
    full, quick = (path.parent for path in packed if getattr(path, "suffix", "") == ".gz")
    assert (full, quick) == (tmp_path / "results", tmp_path / "runs" / "bench")


def test_the_published_page_holds_known_sections_alone():
    text = (Path(__file__).resolve().parents[2] / "docs" / "benchmarks.md").read_text(encoding="utf-8")
    assert set(read(text)) <= set(SECTIONS)
    assert written(read(text), tuple(SECTIONS)) == text


CODE = '"""Words."""\n\ndef one() -> int:\n    """More."""\n    return 1\n'


@pytest.mark.parametrize(
    ("name", "text", "other", "same"),
    [
        ("module.py", CODE, "def one() -> int:  # a remark\n\n    return 1\n", True),
        ("module.py", CODE, CODE.replace("return 1", "return 2"), False),
        ("gains.yaml", "kp: 1\n", "kp: 2\n", False),
        ("module.py", "from a.b import c, d\n", "from a import d\nfrom e import c\n", True),
        ("module.py", "from a import c\n", "from a import d as c\n", False),
    ],
    ids=[
        "comments, layout and docstrings",
        "what code does",
        "what is no code",
        "where a name lies",
        "its name",
    ],
)
def test_a_stamp_changes_with_what_code_does_and_with_any_other_file(
    tmp_path, monkeypatch, name, text, other, same
):
    monkeypatch.setattr(stamps, "ROOT", tmp_path)
    kept_stamps = []
    for content in (text, other):
        (tmp_path / name).write_text(content)
        stamps.stamp.cache_clear()
        kept_stamps.append(stamps.stamp(name))
    stamps.stamp.cache_clear()
    assert (kept_stamps[0] == kept_stamps[1]) is same


def test_code_that_moves_to_another_file_keeps_its_stamp(tmp_path, monkeypatch):
    monkeypatch.setattr(stamps, "ROOT", tmp_path)
    for name, text in (("a.py", "x = 1\n"), ("b.py", "y = 2\n")):
        (tmp_path / name).write_text(text)
    stamps.stamp.cache_clear()
    before = stamps.stamp("*.py")
    (tmp_path / "a.py").rename(tmp_path / "c.py")
    stamps.stamp.cache_clear()
    assert stamps.stamp("*.py") == before
    (tmp_path / "b.py").write_text("y = 3\n")
    stamps.stamp.cache_clear()
    assert stamps.stamp("*.py") != before
    stamps.stamp.cache_clear()


def test_what_a_module_imports_or_names_in_a_table_is_found_by_reading_and_what_keeps_results_is_not(
    tmp_path, monkeypatch
):
    monkeypatch.setattr(stamps, "ROOT", tmp_path)
    for folder in ("bench", "bridge", "identify"):
        (tmp_path / folder).mkdir()
    (tmp_path / "bench/trials.py").write_text(
        'import json\nfrom bench import plan, words\nfrom identify.dive import Dive\nOWN = {"a": "bench.sindy"}\n'
    )
    for name in ("plan", "sindy", "words"):
        (tmp_path / f"bench/{name}.py").write_text("")
    (tmp_path / "identify/dive.py").write_text("def read():\n    from bridge import clock\n")
    (tmp_path / "bridge/clock.py").write_text("")
    (tmp_path / "bridge/other.py").write_text("")
    stamps.walked.cache_clear()
    try:
        modules = stamps.reached("bench/trials.py")
        those = stamps.reached("bench/trials.py", belongs=lambda path: not path.startswith("bridge/"))
        read, kept = (
            [str(file.relative_to(tmp_path)) for file in stamps.files(source)] for source in (modules, those)
        )
    finally:
        stamps.walked.cache_clear()
    made = ["bench/plan.py", "bench/sindy.py", "bench/trials.py"]
    assert read == [*made, "bridge/clock.py", "identify/dive.py"]
    assert kept == [*made, "identify/dive.py"]


def _never():
    raise AssertionError("measured again")


def test_a_line_that_a_kill_cut_short_is_measured_again_and_spoils_nothing(tmp_path):
    path = tmp_path / "kept.jsonl"
    Remembered(path).put("one", {"value": 1})
    with path.open("a") as out:
        out.write('{"key": "two", "da')
    again = Remembered(path)
    assert "two" not in again
    again.put("three", {"value": 3})
    last = Remembered(path)
    assert last.get("one", _never) == {"value": 1}
    assert last.get("three", _never) == {"value": 3}


def test_jobs_that_are_known_are_not_run_and_the_others_are(tmp_path):
    kept = Remembered(tmp_path / "kept.jsonl")
    kept.put("known", {"value": 1})
    results = kept.fill({"known": _never, "new": partial(dict, value=2)}, "test")
    assert results == {"known": {"value": 1}, "new": {"value": 2}}


def test_what_runs_on_while_another_job_fails_is_kept(tmp_path, monkeypatch):
    failed = tmp_path / "failed"

    def track(futures, *_, **__):
        for future in futures:
            if future.exception():
                failed.touch()
            yield future

    monkeypatch.setattr("bench.remembered.track", track)
    waits = f"import pathlib\nwhile not pathlib.Path({str(failed)!r}).exists(): pass"
    jobs = {"runs on": partial(eval, f"exec({waits!r}) or {{'a': 1}}"), "fails": partial(eval, "1 / 0")}
    with pytest.raises(ZeroDivisionError):
        Remembered(tmp_path / "kept.jsonl").fill(jobs, "jobs")
    kept = Remembered(tmp_path / "kept.jsonl")
    assert "fails" not in kept
    assert kept.get("runs on", dict) == {"a": 1}


def test_a_file_that_cannot_be_written_is_told(tmp_path):
    kept = Remembered(tmp_path / "kept.jsonl")
    (tmp_path / "kept.jsonl").mkdir()
    with pytest.raises(LogError, match="can't be written"):
        kept.put("one", {})


def test_all_readers_meet_the_same_frames(tmp_path):
    encoder = Encoder(1, 1)
    data = b""
    for k in range(50):
        message = mav.MAVLink_attitude_message(100 * k, 0.0, 0.0, 0.5, 0.0, 0.0, 0.1)
        data += (1_790_000_000_000_000 + 100_000 * k).to_bytes(8, "big") + encoder.encode(message)
    log = tmp_path / "a.tlog"
    log.write_bytes(data)
    speed = measured(log)
    assert speed["messages"] == {OURS: 50, CAREFUL: 50, THEIRS: 50}
    assert speed["bytes"] == len(data)
    assert min(speed["seconds"].values()) > 0


def stated(value, std):
    return Stated(value, value * math.exp(-Z95 * std), value * math.exp(Z95 * std), False)


def trial(seed, method, **values):
    return Trial(seed, method, {name: stated(*value) for name, value in values.items()}, (), "converged", 1.0)


FIRST, SECOND = SIDE_BY_SIDE


def test_what_both_state_is_apart_by_the_larger_standard_error():
    trials = [
        trial(1, FIRST, M_u=(100.0, 0.01), M_v=(90.0, 0.1)),
        trial(1, SECOND, M_u=(100.0 * math.exp(0.04), 0.02)),
        trial(2, FIRST, M_u=(100.0, 0.01)),
    ]
    distances = accuracy.distances(trials)
    assert list(distances) == [1]
    assert distances[1] == pytest.approx([2.0])


NAN = math.nan
FILE = load_vehicle("ruvifist:survey")


def _dived(nu):
    time_s = 0.05 * np.arange(1, len(nu) + 1)
    state = np.column_stack([np.zeros((len(nu), 3)), np.ones((len(nu), 1)), np.zeros((len(nu), 3)), nu])
    fog = Signal(time_s, np.ones((len(nu), 1)))
    return Dived(Dive("flown", Path("flown.tlog"), "0", fog=fog), FILE, "survey", {}, time_s, state)


def test_a_cell_is_the_rms_error_and_the_median_interval_of_those_that_answered():
    cell = shorter_recordings.cell([110.0, 90.0], [11.0, NAN], 100.0)
    assert cell == shorter_recordings.Cell(2, pytest.approx(0.1), pytest.approx(0.1))


def test_the_page_of_shorter_recordings_says_how_long_the_hovering_campaign_is(tmp_path, monkeypatch):
    refused = {"value": {}, "half95": {}, "trim": [], "refusal": "short"}
    campaign = SimpleNamespace(truth={}, dive=SimpleNamespace(duration_s=700.4))
    answers = dict.fromkeys(map(str, shorter_recordings.LENGTHS_S), refused)
    monkeypatch.setattr(shorter_recordings, "dived", lambda *_: campaign)
    monkeypatch.setattr(shorter_recordings, "NAMES", dict.fromkeys(shorter_recordings.NAMES, ()))
    monkeypatch.setattr(
        shorter_recordings.Remembered, "fill", lambda _, jobs, __: dict.fromkeys(jobs, answers)
    )
    assert "hovering campaign is over after 700 s" in " ".join(
        shorter_recordings.page(tmp_path, (901,)).split()
    )


def test_a_share_of_more_than_all_is_written_out_in_per_cent():
    shares = (0.0, 0.00047, 0.0994, 0.994, 0.996, 1.2, 25.0, math.inf, math.nan)
    assert [percent(share) for share in shares] == ["0", "0.047", "9.9", "99", "100", "120", "2500", "-", "-"]
    assert shorter_recordings._words(shorter_recordings.Cell(3, 1.2, 0.996), 5) == "120 ±100 /3"


def test_a_parameter_settles_where_it_last_left_its_end():
    values = np.array([[10.0, 1.0], [98.0, 1.0], [101.5, 1.0], [100.5, 1.0], [100.0, 1.0]])
    empty = np.zeros(5)
    assert TrainingCurves(("M_u", "D_u"), values, empty, empty, empty).settled_at == 3
    assert TrainingCurves(("M_u", "D_u"), values[-1:], empty, empty, empty).settled_at == 0


def test_a_steady_error_leaves_the_transient_out_and_counts_too_fast_as_positive_either_way():
    legs = (
        (Leg(5.0, "change", "acceleration", surge_m_s=-0.4, transient_s=5.0), 0.0, 5.0),
        (Leg(10.0, "hold", "steady", surge_m_s=-0.4), 5.0, 15.0),
    )
    nu = np.zeros((round(17.0 / 0.05), 6))
    since_s = 0.05 * np.arange(1, len(nu) + 1) - 1.0
    nu[since_s >= 7.0 - 1e-6, 0] = -0.41
    assert steady_errors(_dived(nu), legs) == {"surge 0.4": [pytest.approx(0.01)]}


def test_the_true_dive_has_the_true_velocities_and_no_gyro_beside_them():
    measured_dive = _dived(np.full((10, 6), 0.3))
    true = truly(measured_dive)
    assert true.gyro is not None
    assert true.fog is None
    assert (true.velocity.value == 0.3).all()


def test_a_refusal_is_an_answer_with_its_reason():
    mission = draw_one(100_003)
    empty = replace(mission.dive, velocity=None, gyro=None, fog=None)
    refusal = answered("closed form", empty, mission.file, mission.configuration)
    assert refusal["value"] == {}
    assert "nothing can be identified" in refusal["refusal"]


def test_the_methods_of_others_answer_a_mission_with_finite_values():
    mission = draw_one(100_003, seconds=60.0)
    for name in ("closed form", "least squares"):
        result = answered(name, mission.dive, mission.file, mission.configuration)
        assert result["value"]
        assert all(math.isfinite(value) for value in result["value"].values())
        assert set(result["half95"]) <= set(result["value"])


def test_the_closed_form_needs_no_training_to_come_near_the_truth():
    mission = draw_one(100_003)
    fitted = closed_form.estimate(mission.dive, mission.file, mission.configuration, lambda *_report: None)
    for name, value in fitted.values().items():
        assert value == pytest.approx(mission.truth[name], rel=0.5)
        assert math.isnan(fitted[name].std)
