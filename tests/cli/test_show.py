"""What verbs show: numbers, tables, JSON."""

import json

import pytest

from bridge.clock import SimulatedClock
from bridge.errors import LogError
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


def test_progress_without_a_terminal_is_a_line_every_few_seconds(monkeypatch, capsys):
    clock = SimulatedClock()
    monkeypatch.setattr(show, "SystemClock", lambda: clock)
    with show.progress("dive") as tell:
        for percent in range(101):
            clock.advance_to(percent / 10)
            tell(percent / 100, "")
    assert capsys.readouterr().err == " 50% dive\n100% dive\n"


def test_brackets_in_a_note_are_shown_as_they_are(capsys):
    show.results().print("note: [bold] is no markup here")
    assert capsys.readouterr().out == "note: [bold] is no markup here\n"


def test_a_table_shows_each_row_whole(capsys):
    show.results().print(show.table("title", ("name", "value"), [("M_u", "111.6")], numbers=("value",)))
    shown = capsys.readouterr().out
    assert [line.split() for line in shown.splitlines() if "M_u" in line] == [["M_u", "111.6"]]
