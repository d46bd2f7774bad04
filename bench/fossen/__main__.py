"""`python -m bench.fossen FOLDER OUT`: which run of each vehicle holds what the other does not, as OUT/VEHICLE.json."""

import argparse
import json
import logging
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bench.fossen.answer import answer
from bench.fossen.evidence import Judged, judged
from bench.fossen.runs import NEEDED, STATES, load_run
from bridge.errors import LogError

log = logging.getLogger(__name__)


def said(found: Judged) -> str:
    """State in a sentence which run holds an effect, and how probable each of its causes is."""
    if found.verdict == "no_gap":
        return "no run holds anything that the other does not"
    holder = "one of the runs, which can't be told," if found.run is None else f"run {found.run}"
    if found.verdict == "unknown":
        return f"{holder} holds something that has no name here"
    causes = ", ".join(
        f"{name} ({100 * probability:.0f} %)" for name, probability in found.probabilities.items()
    )
    return f"{holder} holds what the other does not: {causes}"


def command(words: Sequence[str]) -> int:
    """Run the command; return 0, or 1 after logging a LogError; argparse exits with 2 if an argument is missing."""
    parser = argparse.ArgumentParser(prog="python -m bench.fossen", description=__doc__)
    parser.add_argument("folder", metavar="FOLDER", type=Path, help="the simulator's runs")
    parser.add_argument(
        "out", metavar="OUT", type=Path, help="the folder to write into; made where it is not there"
    )
    given = parser.parse_args(words)
    try:
        main(given.folder, given.out)
    except LogError as error:
        log.error("bench.fossen: %s", error)
        return 1
    return 0


def main(folder: Path, out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise LogError(f"{out}: is no folder to write into ({error.strerror}); give another one") from None
    for vehicle in NEEDED:
        verdict = judged(vehicle, {name: load_run(folder, vehicle, name) for name in "ab"})
        log.info("%s: %s; left on pieces held out of %s", vehicle, said(verdict), STATES)
        for candidate in verdict.weighed:
            log.info(
                "  %-38s %s %s",
                candidate.candidate.name,
                np.round(candidate.left, 4),
                np.round(candidate.values, 4),
            )
        text = json.dumps(answer(verdict), indent=2) + "\n"
        (out / f"{vehicle}.json").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    sys.exit(command(sys.argv[1:]))
