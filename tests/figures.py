"""Figures that long tests measure, kept for docs/reliability.md."""

import json
import os
from datetime import UTC, datetime
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "reliability"
WANTED = "SEATRIAL_KEEP_FIGURES"
"""Set by `make soak`: a test that is run by hand, on a busy machine say, leaves the page as it is."""


def keep(name: str, measured: str, folder: Path = FOLDER) -> None:
    """The sentence with the figure of the promise docs/reliability/NAME.yaml, where figures are wanted."""
    if os.environ.get(WANTED):
        told = {"measured": measured, "date": datetime.now(UTC).date().isoformat()}
        (folder / f"{name}.json").write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")
