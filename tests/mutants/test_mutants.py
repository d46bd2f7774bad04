"""What steers, writes and diagnoses, changed in one small place: its tests notice."""

import os
import shutil
import subprocess
import sys
from contextlib import contextmanager, nullcontext
from pathlib import Path

import figures
import pytest
from mutants import closest_first, drawn, mutants_of

ROOT = Path(__file__).resolve().parents[2]
JUDGES = {
    "bridge/vehicle": (
        "tests/vehicle", "tests/wire/test_parameter_server.py", "tests/wire/test_parameters_by_hull.py",
        "tests/simulator", "tests/effects", "tests/planning",
    ),
    "gcs_plugin/params": ("tests/ground", "tests/cli", "tests/hostile", "tests/tui_app"),
    "identify/diagnose": ("tests/diagnose", "tests/report", "tests/export", "tests/bench", "tests/effects"),
    "identify/challenge": ("tests/challenge", "tests/bench", "tests/diagnose"),
}  # fmt: skip
COUNT, SEED = 200, 22
PATIENCE_S = 1800.0
CLOSE, FAR = 6, 30
"""Test files run first: most mutants fall to the few that are closest to them, within seconds."""


def test_every_drawn_mutant_is_another_program_and_the_draw_is_the_same_again():
    mutants = drawn(ROOT, tuple(JUDGES), COUNT, SEED)
    assert mutants == drawn(ROOT, tuple(JUDGES), COUNT, SEED)
    assert len(set(mutants)) == COUNT
    for mutant in mutants:
        source = (ROOT / mutant.file).read_bytes()
        compile(mutant.applied(source), mutant.file, "exec")


@pytest.mark.parametrize(
    ("source", "changed"),
    [
        ("a < b", {"a <= b"}),
        ("a - 2", {"a + 2", "a - 20"}),
        ("a and b", {"a or b"}),
        ("x = 0.5 if a else b", {"x = 5.0 if a else b", "x = 0.5 if not (a) else b"}),
        ("f(True)", {"f(False)"}),
        ('"""a < 2"""', set()),
    ],
)
def test_a_mutant_changes_one_thing(source, changed):
    assert {
        mutant.applied(source.encode()).decode() for mutant in mutants_of("m.py", source.encode())
    } == changed


def test_the_tests_that_import_a_module_come_before_those_that_do_so_by_another_and_these_before_the_others():
    judges = JUDGES["identify/challenge"]
    tests = closest_first(ROOT, judges, "identify/challenge/seal.py")
    files = (
        "challenge/test_seal_and_score",
        "bench/test_unknown",
        "challenge/test_fixed_set",
        "bench/test_sources",
    )
    places = [tests.index(f"tests/{file}.py") for file in files]
    assert places == sorted(places)
    assert set(tests) == set(closest_first(ROOT, judges, "bridge/errors.py"))


@pytest.mark.soak
def test_nineteen_of_twenty_mutants_are_noticed(tmp_path):
    copy = tmp_path / "checkout"
    shutil.copytree(ROOT, copy, ignore=shutil.ignore_patterns(".venv", ".git", ".*_cache", "shared"))
    shared = ROOT.parent / "shared"
    if shared.is_dir():
        (tmp_path / "shared").symlink_to(shared)
    assert not [folder for folder, tests in JUDGES.items() if fails(copy, tests)], "without any mutant"
    survivors = [str(mutant) for mutant in drawn(copy, tuple(JUDGES), COUNT, SEED) if survives(copy, mutant)]
    share = 1 - len(survivors) / COUNT
    figures.keep("mutants", f"{100 * share:.1f} % of {COUNT} noticed")
    assert share >= 0.95, "\n".join(survivors)


def survives(copy, mutant):
    judges = JUDGES[next(folder for folder in JUDGES if mutant.file.startswith(folder))]
    tests = closest_first(copy, judges, mutant.file)
    file = copy / mutant.file
    source, stat = file.read_bytes(), file.stat()
    with without_kernels(copy) if b"njit" in source else nullcontext():
        try:
            file.write_bytes(mutant.applied(source))
            return not any(
                fails(copy, part) for part in (tests[:CLOSE], tests[CLOSE:FAR], tests[FAR:]) if part
            )
        finally:
            file.write_bytes(source)
            os.utime(file, ns=(stat.st_atime_ns, stat.st_mtime_ns))


@contextmanager
def without_kernels(copy):
    """Meanwhile no compiled kernel is there: each holds what it calls as it was then."""
    kept = {path: path.read_bytes() for path in copy.rglob("*.nb?")}
    for path in kept:
        path.unlink()
    try:
        yield
    finally:
        for path in copy.rglob("*.nb?"):
            path.unlink()
        for path, data in kept.items():
            path.write_bytes(data)


def fails(copy, tests):
    """Whether a test fails, or hangs."""
    words = [sys.executable, "-m", "pytest", "-x", "-q", "-n", "2", "-p", "no:cacheprovider", *tests]
    places = os.environ | {"PYTHONPATH": str(copy)}
    try:
        return (
            subprocess.run(words, cwd=copy, env=places, timeout=PATIENCE_S, capture_output=True).returncode
            != 0
        )
    except subprocess.TimeoutExpired:
        return True
