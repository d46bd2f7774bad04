"""The wheel that `make wheel` builds holds all that the command needs, away from the checkout."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.soak
def test_the_wheel_dives_a_shipped_vehicle_where_there_is_no_checkout(tmp_path):
    made = subprocess.run(
        ["make", "-C", ROOT, "wheel", f"BIN={Path(sys.executable).parent}"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    (wheel,) = (ROOT / line for line in made.stdout.splitlines() if line.endswith(".whl"))
    pip = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--quiet",
        "--no-deps",
        "--target",
        tmp_path / "site",
        wheel,
    ]
    subprocess.run(pip, check=True)
    dive = ["simulate", "--vehicle", "ruvifist:hovering", "--mission", "validation", "--out", "dives"]
    subprocess.run(
        [sys.executable, "-P", "-m", "tui", *dive],
        cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(tmp_path / "site")}, check=True,
    )  # fmt: skip
    assert list(tmp_path.glob("dives/*-validation-off/telemetry.tlog"))
    assert (tmp_path / "site/bin/seatrial").exists()
