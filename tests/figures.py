"""Figures that long tests measure, kept for docs/reliability.md.

A figure stands beside its promise (docs/reliability/NAME.json) with the day and the commit that it was measured on.
A long test that fails takes the figure of its promise away.
"""

import json
import os
import subprocess
from datetime import UTC, datetime
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "docs" / "reliability"
WANTED = "SEATRIAL_KEEP_FIGURES"
"""Set by `make soak`: a test that is run by hand, on a busy machine say, leaves the page as it is."""


def keep(name: str, measured: str, folder: Path = FOLDER) -> None:
    """Keep the figure of the promise NAME, a sentence, if figures are wanted."""
    if os.environ.get(WANTED):
        figure = {"measured": measured, "date": datetime.now(UTC).date().isoformat(), "code": commit()}
        (folder / f"{name}.json").write_text(json.dumps(figure, indent=1) + "\n", encoding="utf-8")


def take_away(failed: str, folder: Path = FOLDER) -> None:
    """Remove the figures of the promises whose long tests include `failed`, a test's node, if figures are wanted."""
    if os.environ.get(WANTED):
        for promise in folder.glob("*.yaml"):
            if failed in yaml.safe_load(promise.read_text(encoding="utf-8")).get("long", ()):
                promise.with_suffix(".json").unlink(missing_ok=True)


def commit(root: Path = ROOT) -> str:
    """The commit that is checked out, with `+` if files differ from it; empty outside a repository."""
    described = subprocess.run(
        ["git", "describe", "--always", "--abbrev=8", "--dirty=+", "--exclude=*"],
        cwd=root,
        capture_output=True,
        text=True,
        check=False,
    )
    return described.stdout.strip()
