"""CI tells of known holes in what is installed, takes no silence for safety, and no skipped test for a pass: but for
data beside the checkout, and a firmware, where there are none.
"""

import os
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from soak import rows_rest_in_soak

AUDIT = Path(__file__).resolve().parents[1] / ".ci" / "audit.py"


@pytest.fixture
def audit():
    return runpy.run_path(str(AUDIT))


def test_a_hole_is_told_with_what_mends_it(audit):
    hole = {"id": "PYSEC-1", "fix_versions": ["1.1", "2.0"], "aliases": [], "description": ""}
    packages = [
        {"name": "a", "version": "1.0", "vulns": [hole, hole | {"id": "PYSEC-2", "fix_versions": []}]},
        {"name": "b", "version": "3.0", "vulns": []},
        {"name": "seatrial", "skip_reason": "not on the index"},
    ]
    assert audit["sentences"]({"dependencies": packages}) == [
        "audit: HOLE a 1.0: PYSEC-1, mended in 1.1, 2.0",
        "audit: HOLE a 1.0: PYSEC-2, mended in none yet",
        "audit: 2 known holes in 2 packages; of 1 nothing is known",
    ]


@pytest.mark.parametrize("packages", [[], [{"name": "a", "skip_reason": "not found"}]])
def test_a_list_that_answers_for_nothing_is_not_taken_for_safe(audit, packages):
    assert audit["sentences"]({"dependencies": packages}) == [
        "audit: skipped, the list of known holes does not answer for any package"
    ]


def test_an_index_that_does_not_answer_is_said_and_fails_nothing(audit, tmp_path, monkeypatch):
    (tmp_path / "lib" / "python3.11" / "site-packages").mkdir(parents=True)
    monkeypatch.setattr("venv.create", lambda *_, **__: None)
    asked = []

    def slow(step, **_):
        asked.append(step)
        raise subprocess.TimeoutExpired(step, 300)

    monkeypatch.setattr(subprocess, "run", slow)
    assert audit["audited"](tmp_path) == ["audit: skipped, the index does not answer within 300 s"]
    monkeypatch.setattr(subprocess, "run", lambda step, **_: asked.append(step))
    assert audit["audited"](tmp_path) == [
        "audit: skipped, the index or its list of known holes does not answer"
    ]
    assert len(asked) == 3
    assert audit["audited"](tmp_path / "none") == [f"audit: skipped, {tmp_path / 'none'} is no environment"]


CONFTEST = [Path(__file__).with_name(name) for name in ("conftest.py", "figures.py")]


def run_suite(folder, reason, ci, shared):
    """The exit code of a suite with one passing and one skipped test, as `make test` runs it."""
    tests = folder / "checkout" / "tests"
    tests.mkdir(parents=True)
    if shared:
        (folder / "shared").mkdir()
    for file in CONFTEST:
        shutil.copy(file, tests)
    (tests / "test_small.py").write_text(
        f"import pytest\ndef test_one():\n    assert True\ndef test_two():\n    pytest.skip({reason!r})\n"
    )
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-rs", "-p", "no:cacheprovider", "-n", "1", tests],
        cwd=tests,
        env=os.environ | {"CI": ci},
        capture_output=True,
        text=True,
        check=False,
    )
    assert "1 passed, 1 skipped" in done.stdout.splitlines()[-1], done.stdout
    return done.returncode


@pytest.mark.parametrize(
    ("reason", "ci", "shared", "code"),
    rows_rest_in_soak(
        [
            ("needs a browser", "true", False, 1),
            ("needs ../shared/data", "true", False, 0),
            ("needs a browser", "", True, 0),
            ("needs ../shared/data", "true", True, 1),
            ("needs a browser", "true", True, 1),
            ("needs SEATRIAL_ARDUSUB=/path/to/ardusub", "true", True, 0),
        ],
        keep=2,
    ),
)
def test_a_skip_fails_ci_unless_it_lacks_the_data_beside_the_checkout(tmp_path, reason, ci, shared, code):
    assert run_suite(tmp_path, reason, ci, shared) == code
