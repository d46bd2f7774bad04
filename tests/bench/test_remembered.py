"""Results that survive a kill."""

from functools import partial
from pathlib import Path

import pytest

from bench.remembered import Remembered
from bridge.errors import LogError


def _never() -> dict[str, int]:
    raise AssertionError("measured again")


def test_what_was_measured_is_not_measured_again(tmp_path: Path) -> None:
    path = tmp_path / "folder" / "kept.jsonl"
    assert Remembered(path).get("one", lambda: {"value": 1}) == {"value": 1}
    assert Remembered(path).get("one", _never) == {"value": 1}


def test_a_line_that_a_kill_cut_short_is_measured_again_and_spoils_nothing(tmp_path: Path) -> None:
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


def test_jobs_that_are_known_are_not_run_and_the_others_are(tmp_path: Path) -> None:
    kept = Remembered(tmp_path / "kept.jsonl")
    kept.put("known", {"value": 1})
    found = kept.fill({"known": _never, "new": partial(dict, value=2)}, "test")
    assert found == {"known": {"value": 1}, "new": {"value": 2}}


def test_a_file_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    kept = Remembered(tmp_path / "kept.jsonl")
    (tmp_path / "kept.jsonl").mkdir()
    with pytest.raises(LogError, match="can't be written"):
        kept.put("one", {})
