"""`seatrial reproduce`: the source paper's campaigns and figures on the simulated vehicle, on one page."""

import argparse
from functools import partial
from pathlib import Path

from bench.reproduce import page
from bench.reproduce.comparisons import validation
from bench.reproduce.paper import sized
from bench.reproduce.run import reproduce
from bridge import clock as clocks
from bridge import exit_codes
from gcs_plugin.dives.folder import new_folder
from tui import show
from tui.files import Files

PAGE, RESULT = "reproduction.html", "result.json"


def run(arguments: argparse.Namespace) -> int:
    clock = clocks.SystemClock()
    folder = new_folder(Path(arguments.out), clock.unix_s(), f"seed-{arguments.seed}").path
    with show.progress("reproduce") as tell:
        done = reproduce(folder, arguments.seed, clock.unix_s(), sized(arguments.network), tell)
    dives = [*(campaign.dive for campaign in done.campaigns.values()), *done.dives.values()]
    with Files() as files:
        files.publish(arguments, partial(page.report, done), dives, done.file, str(folder / PAGE))
        console = show.results(arguments.json)
        rows = [
            (
                row.figure,
                row.what,
                row.unit,
                *(show.number(n) for n in (row.paper, row.by_paper, row.by_ours)),
            )
            for row in validation(done)
        ]
        columns = ("figure", "number", "unit", "paper", "its values", "our values")
        show.put(
            console,
            show.Table("the paper's validation dives beside ours", columns, rows, numbers=columns[3:]),
        )
        show.say(console, page.verdict(done))
        show.say(console, *files.written)
        show.say(console, f"recordings and results: {folder}")
        show.say(console, f"took {clock.boot_s():.0f} s")
        outcome = page.to_json(done) | {"page": str(folder / PAGE), "folder": str(folder)}
        files.json(outcome, str(folder / RESULT))
        files.json(outcome, arguments.json)
    return files.code(exit_codes.DONE)
