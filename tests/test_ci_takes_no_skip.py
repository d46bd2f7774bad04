"""In CI a skipped test is a failure, except for data beside the checkout, and a firmware, where there are none."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from soak import rows_rest_in_soak

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
            ("needs a browser", "", True, 0),
            ("needs a browser", "true", False, 1),
            ("needs ../shared/data", "true", False, 0),
            ("needs ../shared/data", "true", True, 1),
            ("needs a browser", "true", True, 1),
            ("needs SEATRIAL_ARDUSUB=/path/to/ardusub", "true", True, 0),
        ],
        keep=4,
    ),
)
def test_a_skip_fails_ci_unless_it_lacks_the_data_beside_the_checkout(tmp_path, reason, ci, shared, code):
    assert run_suite(tmp_path, reason, ci, shared) == code
