"""`make install` says what it fetches, not all that pip says, and ends as pip does."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PIP = """#!/bin/sh
case "$*" in
  *+cpu*) echo "no such build" >&2; exit 1 ;;
  *torch*) echo "Collecting torch==2.0"; echo "  Downloading https://x.org/whl/torch-2.0-cp312-linux.whl (174.7 MB)" ;;
  *) echo "Collecting numpy>=2"; echo "  Using cached numpy-2.1-cp312.whl (16.4 MB)"
     echo "  Downloading rich-13.0-py3-none-any.whl (240 kB)"; echo "Installing collected packages: numpy, rich"
     exit $ENDS ;;
esac
"""


@pytest.mark.parametrize("ends", [0, 1])
def test_what_is_large_is_said_as_it_is_fetched_and_a_pip_that_fails_fails_it(tmp_path, ends):
    for name in ("Makefile", "pyproject.toml"):
        shutil.copy(ROOT / name, tmp_path)
    bin_folder = tmp_path / ".venv" / "bin"
    bin_folder.mkdir(parents=True)
    for name in ("python", "pip"):
        (bin_folder / name).write_text(PIP, encoding="utf-8")
        (bin_folder / name).chmod(0o755)
    run = subprocess.run(
        ["make", "install", f"PYTHON={sys.executable}"],
        cwd=tmp_path,
        env={"PATH": "/usr/bin:/bin", "ENDS": str(ends)},
        capture_output=True,
        text=True,
        check=False,
    )
    first, *said = run.stdout.splitlines()
    assert first.startswith("installing into .venv (PyTorch ")
    lines = [
        "  torch, 174.7 MB",
        "what else it needs ...",
        "  numpy, 16.4 MB",
        "  installing what was fetched ...",
    ]
    assert said[:4] == lines
    assert (run.returncode == 0, (tmp_path / ".venv" / ".installed").exists()) == (ends == 0, ends == 0)
