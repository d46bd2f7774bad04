"""The arrows between the four rooms hold, and help costs no heavy import."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
HEAVY = ("torch", "scipy", "numba", "textual", "pymavlink", "rich", "matplotlib")


def test_imports_point_one_way():
    done = subprocess.run(
        [
            sys.executable,
            "-c",
            "from importlinter.cli import lint_imports; raise SystemExit(lint_imports(no_cache=True))",
        ],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize(
    "line", [["--help"], ["bridge", "--help"], ["identify", "--help"], ["params", "--help"]]
)
def test_help_imports_nothing_heavy(line):
    code = (
        f"import sys; from tui.cli import main; code = main({line!r}); "
        f"print(code, [m for m in {HEAVY!r} if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "0 []"


@pytest.mark.parametrize("module", ["bridge.service", "bridge.parameters", "bridge.sensors.wayfinder"])
def test_the_bridge_runs_without_torch_scipy_or_textual(module):
    code = f"import sys, {module}; print([m for m in ('torch', 'scipy', 'textual') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"
