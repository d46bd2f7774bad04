"""The page of the benchmark: sections replaced one by one, those of older code labelled."""

import sys
from pathlib import Path

import pytest

from bench import __main__ as command
from bench.document import HEAD, OLDER, Section, compared, read, written
from bench.sections import SECTIONS, Measurement, Run
from bench.stamp import stamp


def test_one_section_is_replaced_and_the_others_stay() -> None:
    order = ("a", "b", "c")
    page = written({"c": Section("## C\nold", "12"), "a": Section("## A", "34")}, order)
    assert page.startswith(HEAD)
    assert read(page) == {"a": Section("## A", "34"), "c": Section("## C\nold", "12")}
    again = read(written({**read(page), "c": Section("## C\nnew", "56")}, order))
    assert again == {"a": Section("## A", "34"), "c": Section("## C\nnew", "56")}


def test_a_section_of_older_code_says_so_and_one_measured_anew_no_longer() -> None:
    page = written(
        compared({"a": Section("## A", "old"), "b": Section("## B", "new")}, {"a": "x", "b": "new"}),
        ("a", "b"),
    )
    assert f"<!-- section: a; code: old -->\n{OLDER}## A" in page
    assert page.count(OLDER) == 1
    assert read(page)["a"] == Section("## A", "old", older=True)
    assert OLDER not in written(compared(read(page), {"a": "old", "b": "new"}), ("a", "b"))


def test_a_section_without_a_stamp_is_of_older_code() -> None:
    (found,) = compared(read(HEAD + "<!-- section: a b -->\n## A\n"), {"a b": "x"}).values()
    assert found == Section("## A", "", older=True)


def test_the_command_marks_what_it_measures_and_labels_what_it_leaves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def page(_run: Run) -> str:
        return "## New"

    for name in ("docs", "bench"):
        (tmp_path / name).mkdir()
    target = tmp_path / "docs" / "benchmarks.md"
    target.write_text(written({"left": Section("## Left", "0ld")}, ("left",)), encoding="utf-8")
    both = {"left": Measurement(page, ("bench/words.py",)), "asked": Measurement(page, ("bench/stamp.py",))}
    monkeypatch.setattr(command, "SECTIONS", both)
    monkeypatch.setattr(command, "ROOT", tmp_path)
    monkeypatch.setattr(sys, "argv", ["bench", "asked"])
    command.main()
    found = read(target.read_text(encoding="utf-8"))
    assert found == {
        "left": Section("## Left", "0ld", older=True),
        "asked": Section("## New", both["asked"].code),
    }


@pytest.mark.parametrize("name", SECTIONS)
def test_every_sections_sources_are_there(name: str) -> None:
    for source in SECTIONS[name].sources:
        assert stamp(source) != stamp("no/such/source"), source


def test_the_published_page_holds_known_sections_alone() -> None:
    text = (Path(__file__).resolve().parents[2] / "docs" / "benchmarks.md").read_text(encoding="utf-8")
    assert set(read(text)) <= set(SECTIONS)
    assert written(read(text), tuple(SECTIONS)) == text
