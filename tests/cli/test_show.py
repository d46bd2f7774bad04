"""What verbs show: numbers, tables, JSON."""

import errno
import json
import os
from pathlib import Path

import pytest

from bridge.clock import SimulatedClock
from bridge.errors import LogError
from identify.progress import Step
from tui import show


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


def test_json_has_null_for_what_does_not_exist(capsys):
    show.write_json({"a": float("nan"), "b": [float("inf"), 1.5], "c": None}, "-")
    assert json.loads(capsys.readouterr().out) == {"a": None, "b": [None, 1.5], "c": None}


def test_json_goes_into_a_file_and_nowhere_without_one(tmp_path, capsys):
    show.write_json([1], str(tmp_path / "out.json"))
    show.write_json([1], None)
    assert json.loads((tmp_path / "out.json").read_text(encoding="utf-8")) == [1]
    assert capsys.readouterr().out == ""


def test_json_that_can_not_be_written_names_the_file(tmp_path):
    with pytest.raises(LogError, match="nowhere"):
        show.write_json([1], str(tmp_path / "nowhere" / "out.json"))


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
        progress(Step("two", 1.0, "converged", {"M_u": (110.53, 3.14)}, True))
        progress(Step("two", 1.0, "converged"))
    assert capsys.readouterr().err.splitlines() == [
        "one: step 3 (30%)",
        "two: dive (15%)",
        "one: step 6 (60%)",
        "two: dive (30%)",
        "one: step 9 (90%)",
        "two: dive (45%)",
        "one: step 10 (100%)",
        "two: converged: M_u 110.5 ± 3.1 (100%)",
    ]


def test_brackets_in_a_note_are_shown_as_they_are(capsys):
    show.results().print("note: [bold] is no markup here")
    assert capsys.readouterr().out == "note: [bold] is no markup here\n"


def test_a_table_shows_each_row_whole(capsys):
    table = show.table("title", ("name", "value"), [("M_u", "111.6")], numbers=("value",))
    show.put(show.results(), table)
    shown = capsys.readouterr().out
    assert [line.split() for line in shown.splitlines() if "M_u" in line] == [["M_u", "111.6"]]


def test_a_last_column_without_a_word_in_it_is_no_fault():
    table = show.Table("", ("sensor", ""), [("DVL", ""), ("IMU", "")])
    assert table.lines(80) == ["sensor", "─────────", "DVL", "IMU"]
    assert table.lines(7)[0] == "sensor"


def test_cells_stay_whole_where_a_table_is_wider_than_its_lines(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "40")
    columns = ("parameter", "identified value", "true value", "what became of it")
    row = ("I_r, kg m2", "123.4567", "1.1 to 2.2", "a long sentence that goes on")
    show.put(show.results(), show.table("", columns, [row], numbers=columns[1:3]))
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


def test_sentences_stay_on_one_line_in_a_pipe(monkeypatch, capsys):
    monkeypatch.delenv("COLUMNS", raising=False)
    show.say(show.results(), "word " * 100 + "end")
    assert capsys.readouterr().out == "word " * 100 + "end\n"
