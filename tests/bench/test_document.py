"""The page of the benchmark: sections replaced one by one, those of older code labelled."""

import sys
from pathlib import Path

import pytest

from bench import __main__ as command
from bench import wall
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
        "asked": Section("## New", both["asked"].code, wall_s=0.0),
    }


def test_a_section_that_was_measured_when_no_time_was_kept_does_not_take_that_of_reading_it_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "docs").mkdir()
    target = tmp_path / "docs" / "benchmarks.md"
    one = Measurement(lambda _run: "## A", ("bench/words.py",))
    target.write_text(written({"a": Section("## A", one.code)}, ("a",)), encoding="utf-8")
    monkeypatch.setattr(command, "SECTIONS", {"a": one})
    monkeypatch.setattr(command, "ROOT", tmp_path)
    monkeypatch.setattr(sys, "argv", ["bench"])
    command.main()
    assert read(target.read_text(encoding="utf-8"))["a"].wall_s is None


def test_times_of_sections_are_kept_in_their_marks_and_added_up_at_the_top() -> None:
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
    assert head.endswith("Goal: within 90 min: met.")
    assert read(page)["c"] == Section("## C", "56", wall_s=9999.0, asked=True)


@pytest.mark.parametrize(
    ("times", "told"),
    [
        ({"a": 6000.0}, "Goal: within 90 min: **missed**."),
        ({"a": 60.0, "b": None}, "It was not kept of b, so that the goal of 90 min can't be judged."),
        ({"a": None}, "How long `make bench` took was not kept when these sections were measured."),
    ],
)
def test_the_time_of_all_sections_is_judged_where_it_is_known(
    times: dict[str, float | None], told: str
) -> None:
    assert " ".join(wall.lines(times)).endswith(told)


def test_the_time_of_a_section_adds_up_over_the_runs_of_one_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = iter((0.0, 30.0, 100.0, 112.0, 200.0, 201.0))
    monkeypatch.setattr(wall.time, "perf_counter", lambda: next(clock))
    with pytest.raises(KeyboardInterrupt), wall.timed(tmp_path, "a", "12"):
        raise KeyboardInterrupt
    with wall.timed(tmp_path, "a", "12"):
        pass
    with wall.timed(tmp_path, "a", "34"):
        pass
    assert wall.wall_s(tmp_path, "a", "12") == 42.0
    assert wall.wall_s(tmp_path, "a", "34") == 1.0
    assert wall.wall_s(tmp_path, "b", "12") == 0.0


@pytest.mark.parametrize("name", SECTIONS)
def test_every_sections_sources_are_there(name: str) -> None:
    for source in SECTIONS[name].sources:
        assert stamp(source) != stamp("no/such/source"), source


def test_the_published_page_holds_known_sections_alone() -> None:
    text = (Path(__file__).resolve().parents[2] / "docs" / "benchmarks.md").read_text(encoding="utf-8")
    assert set(read(text)) <= set(SECTIONS)
    assert written(read(text), tuple(SECTIONS)) == text
