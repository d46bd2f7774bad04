"""Speed: from the log of the source paper's survey to parameters with intervals, compared with the paper's network."""

import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import torch

from bench.baselines import closed_form as closed
from bench.campaigns import Dived, dived, silent
from bench.remembered import Data, Remembered
from bench.reproduce.paper import (
    PAPER,
    SETTLED_LOSS,
    SETTLED_VALUE,
    SMALL,
    closed_form,
    estimate_with_curves,
    fixed_values,
    lessons,
)
from bench.stamp import PAPERS_VEHICLE, reached, stamp
from bench.words import blocks, paragraph, table
from bridge.errors import FitError
from identify.estimators.table import METHODS, estimator
from identify.ingest.open import read_dive

SOURCES = (reached("bench/speed/identification.py"), *PAPERS_VEHICLE)
CONFIGURATION = "survey"
DEFAULT_GOAL_S, RATIO_GOAL = 10.0, 1000.0
REPEATS = 3


def page(cache: Path, seed: int) -> str:
    kept = Remembered(cache / f"speed-{stamp(*SOURCES)}.jsonl")
    survey = dived(CONFIGURATION, CONFIGURATION, seed, cache / "dives")
    timed = kept.get(f"{seed}", lambda: measured(survey))
    return words_of(timed)


def measured(survey: Dived) -> Data:
    """Seconds of every method, run one after the other with all cores."""
    read_s, _ = _timed(lambda: read_dive(survey.dive.source, None, survey.file))
    first, again = {}, {}
    for name in METHODS:
        run = partial(estimator(name), survey.dive, survey.file, CONFIGURATION, silent)
        first[name], again[name] = _timed(run)[0], _timed(run)[0]
    command_s, _ = _timed(lambda: _command(survey.dive.source))
    learnt = lessons(survey.dive, survey.file, CONFIGURATION, PAPER)
    filtered_s, _ = _timed(lambda: closed.estimate(survey.dive, survey.file, CONFIGURATION, silent))
    fixed = fixed_values(survey.file.vehicle.configurations[CONFIGURATION])
    solved_s = min(_timed(lambda: closed_form(learnt.data, fixed))[0] for _ in range(REPEATS))
    small_s, (_, curves) = _timed(
        lambda: estimate_with_curves(survey.dive, survey.file, CONFIGURATION, silent, SMALL)
    )
    epoch = replace(PAPER, epochs=1)
    epoch_s, _ = _timed(lambda: estimate_with_curves(survey.dive, survey.file, CONFIGURATION, silent, epoch))
    return {
        "samples": len(learnt.grid),
        "read": read_s,
        "first": first,
        "again": again,
        "command": command_s,
        "closed, filtered": filtered_s,
        "closed": solved_s,
        "small": small_s,
        "settled": curves.settled_at,
        "loss settled": curves.loss_settled_at,
        "epochs": SMALL.epochs,
        "epoch": epoch_s,
        "threads": torch.get_num_threads(),
    }


def _command(log: Path) -> None:
    """Run `seatrial identify` as a crew types it, from a cold start."""
    command = shutil.which("seatrial", path=str(Path(sys.executable).parent))
    if command is None:
        raise FitError("the command 'seatrial' is not beside this Python; install the package first")
    vehicle = f"ruvifist:{CONFIGURATION}"
    subprocess.run([command, "identify", str(log), "--vehicle", vehicle], check=True, capture_output=True)


def words_of(timed: Data) -> str:
    read_s, epoch_s = timed["read"], timed["epoch"]
    epochs, fewest = (most(timed["settled"], timed["loss settled"]) for most in (max, min))
    whole_s = epoch_s * epochs
    first, again = timed["first"], timed["again"]
    rows = [(f"`{name}`", read_s + again[name], "yes") for name in again]
    rows += [
        ("both, one after the other", read_s + sum(again.values()), "yes"),
        ("the command `seatrial identify`, cold start and all", timed["command"], "yes"),
        ("closed form of the paper's loss, with filter", read_s + timed["closed, filtered"], "no"),
        ("the closed form alone: the floor", timed["closed"], "no"),
        ("the paper's network, small (1 x 16), all its epochs", timed["small"], "no"),
        ("the paper's network, 38.3 M weights: ONE epoch", epoch_s, "no"),
        (f"the same to convergence, EXTRAPOLATED to {epochs} epochs", whole_s, "no"),
    ]
    compiled = ", ".join(f"`{name}` {seconds:.1f} s" for name, seconds in first.items())
    quick = "met" if timed["command"] < DEFAULT_GOAL_S else "missed"
    ratio = whole_s / timed["command"]
    return blocks(
        "## Speed",
        paragraph(
            f"From the log of the paper's survey ({timed['samples']} samples at 10 Hz; surge, yaw and heave) to",
            f"parameters, on {timed['threads']} cores, one after the other in one run. Reading the log takes",
            f"{read_s:.1f} s and is in every row with an interval and in the closed form with its filter. Where a",
            f"method has just been installed, its first run also compiles its kernels: {compiled}.",
        ),
        table(
            ("what", "seconds", "with intervals", "one epoch of the paper's takes", "to convergence"),
            [
                (
                    title,
                    f"{seconds:.3g}",
                    interval,
                    f"{epoch_s / seconds:.3g} x",
                    f"{whole_s / seconds:.3g} x",
                )
                for title, seconds, interval in rows
            ],
        ),
        paragraph(
            "The paper does not say how many epochs it trained. The small network, on the same data with the same",
            f"schedule over {timed['epochs']} epochs, has every parameter within {100 * SETTLED_VALUE:g} % of where",
            "it ends",
            f"from epoch {timed['settled']} on, and its own loss within {100 * SETTLED_LOSS:g} % from epoch",
            f"{timed['loss settled']} on; the later one is taken as convergence. The goal of {DEFAULT_GOAL_S:g} s for",
            f"the default is {quick}; that of {RATIO_GOAL:g} times the paper's to convergence is not established:",
            f"by that count it is {ratio:.0f}, by the earlier one ({fewest} epochs)",
            f"{epoch_s * fewest / timed['command']:.0f}. Both counts are the small network's; the full one's own stand",
            "under *The paper's network, whole*.",
        ),
    )


def _timed(work: Callable[[], Any]) -> tuple[float, Any]:
    begun = time.perf_counter()
    result = work()
    return time.perf_counter() - begun, result
