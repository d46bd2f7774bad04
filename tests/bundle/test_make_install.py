"""`make install` says what it fetches, not all that pip says, and ends as pip does; a benchmark gets what it needs."""

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


def made(folder, target, python, ends=0):
    """A target made in a folder whose Python and pip are the program `python`."""
    for name in ("Makefile", "pyproject.toml"):
        shutil.copy(ROOT / name, folder)
    bin_folder = folder / ".venv" / "bin"
    bin_folder.mkdir(parents=True)
    for name in ("python", "pip"):
        (bin_folder / name).write_text(python, encoding="utf-8")
        (bin_folder / name).chmod(0o755)
    return subprocess.run(
        ["make", target, f"PYTHON={sys.executable}"],
        cwd=folder,
        env={"PATH": "/usr/bin:/bin", "ENDS": str(ends)},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize("ends", [0, 1])
def test_what_is_large_is_said_as_it_is_fetched_and_a_pip_that_fails_fails_it(tmp_path, ends):
    run = made(tmp_path, "install", PIP, ends)
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


@pytest.mark.parametrize(("target", "measured"), [("bench", "-m bench"), ("power", "-m bench power")])
def test_a_benchmark_is_measured_with_the_libraries_that_it_needs(tmp_path, target, measured):
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests" / "kernels.py").touch()
    run = made(tmp_path, target, '#!/bin/sh\necho "$*" >>asked\n')
    assert run.returncode == 0, run.stderr
    *_, installed, ran = (tmp_path / "asked").read_text(encoding="utf-8").splitlines()
    assert installed.endswith(" install --editable .[dev,bench]")
    assert ran == measured
