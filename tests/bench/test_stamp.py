"""The stamp of the code that figures hang on."""

from pathlib import Path

import pytest

from bench import stamp as stamps

CODE = '"""Words."""\n\ndef one() -> int:\n    """More."""\n    return 1\n'


def _stamp(root: Path, code: str, monkeypatch: pytest.MonkeyPatch) -> str:
    folder = root / "part"
    folder.mkdir(exist_ok=True)
    (folder / "module.py").write_text(code)
    monkeypatch.setattr(stamps, "ROOT", root)
    stamps.stamp.cache_clear()
    try:
        return stamps.stamp("part")
    finally:
        stamps.stamp.cache_clear()


def test_comments_layout_and_docstrings_change_no_stamp(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = "def one() -> int:  # a remark\n\n    return 1\n"
    assert _stamp(tmp_path, CODE, monkeypatch) == _stamp(tmp_path, other, monkeypatch)


def test_what_the_code_does_changes_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    other = CODE.replace("return 1", "return 2")
    assert _stamp(tmp_path, CODE, monkeypatch) != _stamp(tmp_path, other, monkeypatch)


def test_a_source_that_is_no_code_counts_as_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gains = tmp_path / "gains.yaml"
    monkeypatch.setattr(stamps, "ROOT", tmp_path)
    found = []
    for text in ("kp: 1\n", "kp: 2\n"):
        gains.write_text(text)
        stamps.stamp.cache_clear()
        found.append(stamps.stamp("gains.yaml"))
    stamps.stamp.cache_clear()
    assert found[0] != found[1]


def test_what_a_module_imports_is_found_by_reading_and_what_the_benchmark_is_made_of_is_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stamps, "ROOT", tmp_path)
    for folder in ("bench", "bridge", "identify"):
        (tmp_path / folder).mkdir()
    (tmp_path / "bench/trials.py").write_text(
        "import json\nfrom bench import words\nfrom identify.dive import Dive\n"
    )
    (tmp_path / "bench/words.py").write_text("")
    (tmp_path / "identify/dive.py").write_text("def read():\n    from bridge import clock\n")
    (tmp_path / "bridge/clock.py").write_text("")
    (tmp_path / "bridge/other.py").write_text("")
    stamps.reached.cache_clear()
    try:
        found = stamps.reached("bench/trials.py")
    finally:
        stamps.reached.cache_clear()
    assert found == ("bench/trials.py", "bridge/clock.py", "identify/dive.py")
