"""Write a verb's page and its figures to the places given by `--report` and `--figures`."""

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from bridge.reports import PAGE
from bridge.vehicle.config import VehicleFile
from identify.dive import Dive
from tui import show
from tui.files import Files

if TYPE_CHECKING:
    from identify.report.page import Report

UNTOLD = ("report", "figures", "json", "csv", "out")
"""The places of results are not settings."""

WRITING = "writing the page"


def publish(
    files: Files,
    arguments: argparse.Namespace,
    report: "Callable[[], Report]",
    dives: Sequence[Dive],
    file: VehicleFile,
    page: str | None = None,
) -> None:
    """Write the page to `page`, otherwise to --report, and the figures, with progress, because drawing takes long.

    Without any of these options nothing is drawn.
    """
    page = page or arguments.report
    if not (page or arguments.figures):
        return
    with show.progress(PAGE) as tell:
        tell(0.0, WRITING)
        # They load matplotlib, which takes a second.
        from identify.report.page import with_provenance, write_figures, write_report

        whole = with_provenance(report(), dives, file, settings(arguments))
        if page:
            place = Path(page)
            files.attempt(
                lambda: write_report(place, whole, lambda share: tell(share, WRITING)), f"report: {place}"
            )
        if arguments.figures:
            tell(1.0, "writing the figures")

            def draw() -> None:
                drawn = write_figures(Path(arguments.figures), whole)
                files.written.append(f"figures: {arguments.figures} ({len(drawn) // 2}, each as SVG and PNG)")

            files.attempt(draw)


def settings(arguments: argparse.Namespace) -> dict[str, str]:
    """The command line's settings, given or by default, under the names of their options."""
    return {
        name.replace("_", " "): " ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)
        for name, value in vars(arguments).items()
        if value is not None and value is not False and value != [] and name not in UNTOLD
    }
