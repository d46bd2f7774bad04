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
