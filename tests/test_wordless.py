"""With every sentence of ours replaced by "x", all that programs do is the same: none reads another's words."""

import subprocess
import sys
from pathlib import Path

import pytest
from soak import rest_in_soak

SCRIPT = Path(__file__).with_name("wordless.py")


def flows(folder, seconds, *words):
    """The outcome of the main flows, without words, from a process of its own."""
    folder.mkdir()
    line = [sys.executable, str(SCRIPT), str(folder), seconds, *words]
    done = subprocess.run(line, cwd=SCRIPT.parents[1], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    assert ("read back equal" in done.stdout) is not bool(words)
    return (folder / "flows.json").read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize("seconds", rest_in_soak(("66", "90")))
def test_without_a_sentence_every_outcome_is_the_same(tmp_path, seconds):
    said = flows(tmp_path / "said", seconds)
    assert '"quadratic_drag"' in said
    assert flows(tmp_path / "wordless", seconds, "x") == said
