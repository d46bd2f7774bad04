"""`python -m bench.fossen FOLDER OUT`: which run of each vehicle holds what the other does not, as OUT/VEHICLE.json."""

import argparse
import json
import logging
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bench.fossen.answer import answer, best_alone
from bench.fossen.candidates import BIAS, CURRENT, GROUPS, candidates
from bench.fossen.fit import Pair, Weighed, weigh
from bench.fossen.runs import NEEDED, STATES, load_run
from bridge.errors import FitError, LogError

log = logging.getLogger(__name__)


def judged(folder: Path, vehicle: str) -> tuple[Pair, str, tuple[Weighed, ...]]:
    """The run that holds something, beside the other, and all that was tried.

    Raises FitError where a steady current is not what sets them apart: this analysis knows no other answer.
    """
    runs = {name: load_run(folder, vehicle, name) for name in "ab"}
    tried = candidates(vehicle)
    pairs = {name: Pair(vehicle, runs[other], runs[name]) for name, other in ("ab", "ba")}
    both = {name: weigh(pair, CURRENT) for name, pair in pairs.items()}
    run = min(both, key=lambda name: float(np.mean(both[name].left ** 2)))
    weighed = tuple(weigh(pairs[run], one) for one in tried)
    alone = (BIAS, CURRENT, *(one for one in tried if one.name in GROUPS[vehicle]))
    best = best_alone(weighed, alone)
    if best.candidate is not CURRENT:
        raise FitError(
            f"{vehicle}: '{best.candidate.name}' does better than a steady current between the runs in {folder}; "
            "look at them by hand"
        )
    return pairs[run], run, weighed


def command(words: Sequence[str]) -> int:
    """0, or 1 where something is wrong, which it says; argparse leaves with 2 where an argument is missing."""
    parser = argparse.ArgumentParser(prog="python -m bench.fossen", description=__doc__)
    parser.add_argument("folder", metavar="FOLDER", type=Path, help="the simulator's runs")
    parser.add_argument(
        "out", metavar="OUT", type=Path, help="the folder to write into; made where it is not there"
    )
    given = parser.parse_args(words)
    try:
        main(given.folder, given.out)
    except (FitError, LogError) as error:
        log.error("bench.fossen: %s", error)
        return 1
    return 0


def main(folder: Path, out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise LogError(f"{out}: is no folder to write into ({error.strerror}); give another one") from None
    for vehicle in NEEDED:
        pair, run, weighed = judged(folder, vehicle)
        log.info(
            "%s: run %s holds what the other does not; left on pieces held out of %s", vehicle, run, STATES
        )
        for one in weighed:
            log.info("  %-38s %s %s", one.candidate.name, np.round(one.left, 4), np.round(one.values, 4))
        text = json.dumps(answer(pair, run, weighed), indent=2) + "\n"
        (out / f"{vehicle}.json").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    sys.exit(command(sys.argv[1:]))
