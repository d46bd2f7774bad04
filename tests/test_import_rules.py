"""The arrows between the four rooms hold, and help costs no heavy import."""

import ast
import os
import re
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


def loaded_by(code, modules):
    """Which of the modules a program has loaded at its end, and what it printed."""
    code = f"import sys; {code}; print([m for m in {tuple(modules)!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    return done.stdout.splitlines()[-1], done.stdout


def test_help_imports_nothing_heavy():
    verbs = ("bridge", "identify", "params", "batch")
    lines = [["--help"], *([verb, "--help"] for verb in verbs)]
    code = f"from tui.cli import main; codes = [main(line) for line in {lines!r}]; print('codes', codes)"
    loaded, shown = loaded_by(code, HEAVY)
    assert loaded == "[]"
    assert f"codes {[0] * len(lines)}" in shown


def test_the_bridge_runs_without_torch_scipy_or_textual():
    code = "import bridge.onboard.service, bridge.onboard.parameters, bridge.sensors.wayfinder"
    assert loaded_by(code, ("torch", "scipy", "textual"))[0] == "[]"


@pytest.mark.parametrize("room", ["bridge", "gcs_plugin", "identify"])
def test_no_program_below_the_terminal_starts_it(room):
    """An import in another process would be an arrow that the import rules don't see."""
    named = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path in (ROOT / room).rglob("*.py")
        if re.search(r"[\"'}]tui\b", text := path.read_text(encoding="utf-8"))
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Constant) and str(node.value).partition(".")[0] == "tui"
    ]
    assert named == []


def test_the_vehicles_program_starts_without_the_ground(tmp_path):
    """It reads its options, opens a link and runs, and has no module of another package by then."""
    line = ["--vehicle", "ruvifist:hovering", "--link", "udpout:127.0.0.1:9", "--seconds", "0.1"]
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
    code = "from bridge.onboard.program import main; code = main(['--help']); print('code', code)"
    loaded, shown = loaded_by(code, HEAVY)
    assert loaded == "[]"
    assert "usage: seatrial-bridge" in shown
    assert "code 0" in shown


def test_a_verb_without_a_page_loads_no_torch_and_no_matplotlib():
    """Each takes half a second to a second and a half, on every dive."""
    code = "import tui.commands.diagnose, tui.commands.identify"
    assert loaded_by(code, ("torch", "matplotlib", "scipy.optimize"))[0] == "[]"
