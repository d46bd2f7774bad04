"""The arrows between the four rooms hold, and help costs no heavy import."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
HEAVY = ("torch", "scipy", "numba", "textual", "pymavlink", "rich", "matplotlib", "dask", "distributed")


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
    "line",
    [["--help"], *([verb, "--help"] for verb in ("bridge", "identify", "params", "batch"))],
)
def test_help_imports_nothing_heavy(line):
    code = (
        f"import sys; from tui.cli import main; code = main({line!r}); "
        f"print(code, [m for m in {HEAVY!r} if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "0 []"


@pytest.mark.parametrize(
    "module", ["bridge.onboard.service", "bridge.onboard.parameters", "bridge.sensors.wayfinder"]
)
def test_the_bridge_runs_without_torch_scipy_or_textual(module):
    code = f"import sys, {module}; print([m for m in ('torch', 'scipy', 'textual') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


@pytest.mark.parametrize("room", ["bridge", "gcs_plugin", "identify"])
def test_no_program_below_the_terminal_starts_it(room):
    """An import in another process would be an arrow that the import rules don't see."""
    named = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path in (ROOT / room).rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and str(node.value).partition(".")[0] == "tui"
    ]
    assert named == []


def test_the_vehicles_program_starts_without_the_ground(tmp_path):
    """It reads its options, opens a link and runs, and has no module of another package by then."""
    line = ["--vehicle", "ruvifist", "--link", "udpout:127.0.0.1:9", "--seconds", "0.1"]
    code = (
        f"import sys; from bridge.onboard.program import main; main({line!r}); "
        "print({m.partition('.')[0] for m in sys.modules} & "
        "{'tui', 'gcs_plugin', 'identify', 'rich', 'numba', 'scipy', 'torch', 'textual'})"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "XDG_STATE_HOME": str(tmp_path)},
    )
    assert done.stdout.splitlines()[-1] == "set()"
    assert "ruvifist, configuration" in done.stderr


def test_help_of_the_vehicles_program_imports_nothing_heavy():
    code = (
        "import sys; from bridge.onboard.program import main; code = main(['--help']); "
        f"print(code, [m for m in {HEAVY!r} if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert "usage: seatrial-bridge" in done.stdout
    assert done.stdout.splitlines()[-1] == "0 []"


@pytest.mark.parametrize("verb", ["diagnose", "identify"])
def test_a_verb_without_a_page_loads_no_torch_and_no_matplotlib(verb):
    """Each takes half a second to a second and a half, on every dive."""
    heavy = ("torch", "matplotlib", "scipy.optimize")
    code = f"import sys, tui.commands.{verb}; print([m for m in {heavy!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"
