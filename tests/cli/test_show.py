"""Output of verbs: numbers, JSON, sentences on a dive, and tables that fit 80 columns."""

import errno
import io
import json
import math
import os
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from bridge.clock import SimulatedClock
from bridge.errors import LogError
from bridge.text import say_warning
from bridge.vehicle.coefficients import COEFFICIENTS, MASSES
from bridge.vehicle.config import load_vehicle
from gcs_plugin.params.receipt import Receipt
from gcs_plugin.params.transfer import Outcome as Applied
from gcs_plugin.recording.recorder import DiveCounts
from identify.checks.fit.missing_forces import why_not_identifiable
from identify.dive import Dive
from identify.doubt import Outcome
from identify.estimators.comparison import compare
from identify.identification import Identification, Partner, added_mass, estimate
from identify.progress import Step
from identify.validation.tracking import PHASES, AxisErrors, Row, SteadyError, TrackingErrors
from tui import show
from tui.commands import demo, identify, validate
from tui.commands.record import RecordedDive


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (111.6, 4, "111.6"),
        (9.99999, 3, "10.0"),
        (0.0123456, 3, "0.0123"),
        (123456.0, 4, "123500"),
        (-24.4, 4, "-24.40"),
        (0.0, 4, "0"),
        (float("nan"), 4, "-"),
        (None, 4, "-"),
    ],
)
def test_numbers_have_so_many_significant_digits_and_no_exponent(value, digits, text):
    assert show.number(value, digits) == text


class Unheard(io.StringIO):
    """Standard error that takes no more words."""

    def __init__(self, error):
        super().__init__()
        self.error = error

    def write(self, _):
        raise self.error


@pytest.mark.parametrize(
    "error",
    [BrokenPipeError(errno.EPIPE, "Broken pipe"), OSError(errno.ENOSPC, "No space left on device")],
)
def test_words_that_nobody_can_hear_any_more_end_no_verb(error, monkeypatch):
    monkeypatch.setattr(sys, "stderr", Unheard(error))
    console = show.words()
    for _ in range(2):
        say_warning("the DVL is silent")
        show.say(console, "the recording goes on in its file 2")


def test_results_that_nobody_takes_any_more_end_a_verb(monkeypatch):
    monkeypatch.setattr(sys, "stdout", Unheard(OSError(errno.ENOSPC, "No space left on device")))
    with pytest.raises(OSError, match="No space left"):
        show.say(show.results(), "24 dives")


def test_json_has_null_for_what_does_not_exist(capsys):
    show.write_json({"a": float("nan"), "b": [float("inf"), 1.5], "c": None}, "-")
    assert json.loads(capsys.readouterr().out) == {"a": None, "b": [None, 1.5], "c": None}


def test_json_on_a_full_disk_leaves_what_lay_there_and_no_empty_file(tmp_path, monkeypatch):
    def full(_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    kept = tmp_path / "kept.json"
    show.write_json([1], str(kept))
    monkeypatch.setattr(os, "fsync", full)
    for name in ("kept.json", "new.json"):
        with pytest.raises(
            LogError, match=f"{name}: the JSON can't be written \\(No space left on device\\)"
        ):
            show.write_json([2], str(tmp_path / name))
    assert list(tmp_path.iterdir()) == [kept]
    assert kept.read_text(encoding="utf-8") == "[\n  1\n]\n"


def test_json_goes_into_a_device_and_through_a_link(tmp_path):
    (tmp_path / "link.json").symlink_to(tmp_path / "out.json")
    show.write_json([1], str(tmp_path / "link.json"))
    assert (tmp_path / "link.json").is_symlink()
    assert json.loads((tmp_path / "out.json").read_text(encoding="utf-8")) == [1]
    show.write_json([1], os.devnull)
    assert not Path(os.devnull).is_file()


def test_progress_without_a_terminal_is_a_line_every_few_seconds(monkeypatch, capsys):
    clock = SimulatedClock()
    monkeypatch.setattr(show, "SystemClock", lambda: clock)
    with show.progress("dive") as tell:
        for percent in range(101):
            clock.advance_to(percent / 10)
            tell(percent / 100, "")
    assert capsys.readouterr().err == " 50% dive\n100% dive\n"


def test_of_several_things_each_tells_its_tenths_and_its_end_in_lines_of_its_own(monkeypatch, capsys):
    clock = SimulatedClock()
    monkeypatch.setattr(show, "SystemClock", lambda: clock)
    with show.bars({"one": "one: dive", "two": "two: dive"}) as progress:
        for number in range(11):
            clock.advance_to(2.0 * number)
            progress(Step("one", number / 10, f"step {number}"))
            progress(Step("two", number / 20, ""))
        progress(Step("two", 1.0, "converged", {"M_u": (110.53, 3.14), "D_v": (12340.0, 350.0)}, True))
        progress(Step("two", 1.0, "converged"))
    assert capsys.readouterr().err.splitlines() == [
        "one: step 3 (30%)",
        "two: dive (15%)",
        "one: step 6 (60%)",
        "two: dive (30%)",
        "one: step 9 (90%)",
        "two: dive (45%)",
        "one: step 10 (100%)",
        "two: converged: M_u 110.5 ± 3.1, D_v 12340 ± 350 (100%)",
    ]


def test_brackets_in_a_note_are_shown_as_they_are(capsys):
    show.results().print("note: [bold] is no markup here")
    assert capsys.readouterr().out == "note: [bold] is no markup here\n"


def test_a_last_column_without_a_word_in_it_is_no_fault():
    table = show.Table("", ("sensor", ""), [("DVL", ""), ("IMU", "")])
    assert table.lines(80) == ["sensor", "─────────", "DVL", "IMU"]
    assert table.lines(7)[0] == "sensor"


def test_cells_stay_whole_where_a_table_is_wider_than_its_lines(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "40")
    columns = ("parameter", "identified value", "true value", "what became of it")
    row = ("I_r, kg m2", "123.4567", "1.1 to 2.2", "a long sentence that goes on")
    show.put(show.results(), show.Table("", columns, [row], numbers=columns[1:3]))
    lines = capsys.readouterr().out.splitlines()
    assert "…" not in "".join(lines)
    (first,) = (line for line in lines if "I_r" in line)
    assert first.split("  ")[:1] == ["I_r, kg m2"]
    assert all(cell in first for cell in row[:3])


@pytest.mark.parametrize("width", [40, 80])
def test_sentences_break_between_words_where_lines_have_a_width(monkeypatch, capsys, width):
    monkeypatch.setenv("COLUMNS", str(width))
    path = "/a/" + "long-" * 30 + "path"
    sentence = "a sentence that must be read whole, word by word, on a narrow terminal as on a wide one"
    show.say(show.results(), f"{sentence} {path}")
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1] == path
    assert max(map(len, lines[:-1])) <= width
    assert " ".join(lines[:-1]) == sentence


def test_an_indented_sentence_is_as_far_in_on_each_of_its_lines(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "40")
    show.say(show.results(), "  " + "word " * 20 + "end")
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) > 2
    assert all(line.startswith(("  w", "  e")) for line in lines)
    assert max(map(len, lines)) <= 40


def test_a_number_stands_on_the_line_of_its_unit(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "44")
    show.say(show.results(), "the drift after five seconds falls to 7.7 mm/s, which closes it by some 99 %")
    assert capsys.readouterr().out.splitlines() == [
        "the drift after five seconds falls to",
        "7.7 mm/s, which closes it by some 99 %",
    ]


def test_sentences_stay_on_one_line_in_a_pipe(monkeypatch, capsys):
    monkeypatch.delenv("COLUMNS", raising=False)
    show.say(show.results(), "word " * 100 + "end")
    assert capsys.readouterr().out == "word " * 100 + "end\n"


FILE = load_vehicle("ruvifist")
REASON = (
    "the dive says too little of it, and this sentence is as long as the longest of them all, or longer yet"
)


def identification(configuration="hovering"):
    """Every coefficient with as many digits as there can be; those of roll can't be told."""
    totals = tuple(
        estimate(c.name, 1234.5678, 98.7654, 1000.1234, 1500.9876, REASON if c.dof == 3 else "")
        for c in COEFFICIENTS
    )
    totals = tuple(replace(t, partner=Partner("M_v", -0.87), share_from_prior=1.0) for t in totals)
    shape = FILE.vehicle.configurations[configuration]
    return Identification(
        "likelihood", Outcome.DISAGREES, (*totals, *(added_mass(t, shape) for t in totals[: len(MASSES)])),
        configuration, "2026-11-20T0912Z-hovering", "0" * 64, "ruvifist", FILE.sha256, 806.0, 1000, notes=(REASON,),
    )  # fmt: skip


def dive(**signals):
    return Dive(name="2026-11-20T0912Z-hovering", source=Path("a"), sha256="0", **signals)


def campaign(configuration):
    truth = {c.name: 1234.0 for c in COEFFICIENTS}
    return demo.Campaign(configuration, Path("a"), dive(), identification(configuration), truth)


def receipt(root):
    return Receipt(
        Applied.APPLIED, "24 written", 1, 1, (), root / "before.param", 7, "2026-11-20T09:12:00Z", 1.0
    )


def test_the_upload_of_the_demo_is_dated_from_when_it_runs_as_its_dives_are(tmp_path):
    campaigns = tuple(map(campaign, demo.CAMPAIGNS))
    uploaded = demo._upload(FILE, campaigns, tmp_path, 1, tmp_path / "memory.json", 1_795_000_000.0)
    assert uploaded.started_utc.startswith("2026-11-18")


def rows(runs):
    return [
        Row(axis, phase, unit, tuple(0.1234567 for _ in range(runs)))
        for axis, unit in (("surge", "m/s"), ("sway", "m/s"), ("yaw", "rad/s"))
        for phase in PHASES
    ]


def tables():
    """Each table that a verb shows, with a row of it."""
    result, runs = identification(), ("off", "shadow", "ff", "both")
    other = replace(result, method="pinn", parameters=tuple(
        replace(p, value=3 * p.value, low95=2 * p.value, high95=4 * p.value) for p in result.parameters
    ))  # fmt: skip
    speeds = tuple(SteadyError(speed, -0.1234567, 0.1234567, 9) for speed in (0.2, 0.5))
    axes = tuple(
        AxisErrors(axis, "rad/s", *(0.1234567,) * 10, speeds=speeds) for axis in ("surge", "sway", "yaw")
    )
    errors = dict.fromkeys(runs, TrackingErrors("a", axes))
    done = demo.Demo(FILE, tuple(map(campaign, demo.CAMPAIGNS)), receipt(Path("a")), {})
    return {
        "D_r, N m/(rad/s) 1235 1000 to 1501 1234 inside": lambda to: put(to, demo.identified_tables(done)),
        "Surge motion, m/s Acceleration 0.1235 0.1235 0.1235 0.0091": lambda to: put(
            to, [demo.tracking_table(list(demo.MODES), rows(3))]
        ),
        "D_r 1235 1000 1501 N m/(rad/s) 11 M_v -0.87 100 yes": lambda to: identify.tell(to, dive(), result),
        "D_r 1235 3704 N m/(rad/s) 14 disagree": lambda to: identify.tell_comparison(
            to, compare(result, other)
        ),
        "yaw Steady state 7.1 deg/s 7.1 deg/s 7.1 deg/s 7.1 deg/s": lambda to: put(
            to, [validate.error_table(runs, rows(len(runs)))]
        ),
        "yaw 11 deg/s −7.1 deg/s −7.1 deg/s −7.1 deg/s −7.1 deg/s": lambda to: put(
            to, [validate.speed_table(errors)]
        ),
    }


def put(console, shown):
    for table in shown:
        show.put(console, table)


@pytest.mark.parametrize("row", tables())
def test_tables_of_the_verbs_fit_80_columns_and_none_is_cut(row, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    tables()[row](show.results())
    lines = capsys.readouterr().out.splitlines()
    assert "…" not in "".join(lines)
    assert max(map(len, lines)) <= 80
    assert row in [" ".join(line.split()) for line in lines]


def test_the_ends_of_an_interval_break_behind_95_per_cent_where_their_columns_are_narrow():
    ends = [heading for heading in identify.COLUMNS if "95" in heading]
    lines = show.Table("", (*ends, "words"), [("0.4460", "0.4589", "word " * 30)]).lines(30)
    assert [line.split()[:4] for line in lines[:2]] == [["95", "%", "95", "%"], ["low", "high", "words"]]


def test_an_error_in_the_table_is_the_one_that_the_reason_names(capsys):
    """Where the likelihood falls slowly on one side, that side decides."""
    low, high = 15.5 * math.exp(-1.96 * 0.3), 15.5 * math.exp(1.96 * 0.74)
    reason = why_not_identifiable("I_q", "pitch", 0.74, 0.0, 15.5, "")
    loose = estimate("I_q", 15.5, 0.18 * 15.5, low, high, reason)
    answer = identification()
    others = tuple(replace(p, identifiable=True, reason="") for p in answer.parameters if p.name != "I_q")
    identify.tell(show.results(), dive(), replace(answer, parameters=(*others, loose)))
    out = capsys.readouterr().out
    (row,) = [line for line in out.splitlines() if line.startswith("I_q")]
    assert " 74 " in row
    assert "1: the dive says too little of pitch: the relative standard error is 74 %" in out


def test_demo_leaves_in_its_folder_what_was_identified_uploaded_and_received(monkeypatch, tmp_path):
    monkeypatch.setattr(demo, "_campaigns", lambda *_: tuple(map(campaign, demo.CAMPAIGNS)))
    monkeypatch.setattr(demo, "_upload", lambda *_: receipt(tmp_path))
    monkeypatch.setattr(demo, "_validation", lambda *_: dive())
    demo.fly(tmp_path, 1, 0.0, lambda *_: None)
    assert {path.name for path in tmp_path.iterdir()} == {
        f"{configuration}{ending}"
        for configuration in demo.CAMPAIGNS
        for ending in (".json", ".param", ".param.json")
    } | {"receipt.json"}
    assert "FF0_M_U,1234" in (tmp_path / "survey.param").read_text(encoding="utf-8")


FOLDER = Path("dives/2026-11-20T0912Z-lake")


@pytest.mark.parametrize(
    ("count", "words"),
    [
        (DiveCounts(1, 12, 960, 0, 12), f"12 frames, 960 bytes, 0 lost here: {FOLDER}"),
        (
            DiveCounts(1, 10, 800, 2, 12, missed=5, unheard_s=58.25),
            f"10 frames, 800 bytes, 2 lost here, 5 lost on the way, 58 s unheard at a stretch: {FOLDER}",
        ),
    ],
)
def test_the_last_words_of_a_dive(count, words):
    assert RecordedDive(FOLDER, count).words == words


@pytest.mark.parametrize(
    ("count", "advice"),
    [
        (DiveCounts(1, 12, 960, 0, 12, missed=5), ""),
        (
            DiveCounts(1, 12, 960, 0, 12, unheard_s=58.25, keeps_ring=True),
            "58 s unheard: `seatrial fetch` brings what the vehicle kept of it",
        ),
        (
            DiveCounts(1, 12, 960, 0, 12, unheard_s=58.25),
            "58 s unheard: another recording of the dive may have it, see `seatrial merge`",
        ),
    ],
)
def test_of_a_dive_with_a_silence_it_is_said_what_brings_it(count, advice):
    assert RecordedDive(FOLDER, count).advice == advice
