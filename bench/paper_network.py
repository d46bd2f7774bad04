"""The source paper's network in its own size, all its epochs, beside the small one and the closed form of its loss.

Not part of `make bench`: without a graphics card its 100 epochs take hours.
"""

import time
from dataclasses import replace
from pathlib import Path

import torch

from bench.baselines import closed_form
from bench.campaigns import Dived, dived, silent
from bench.remembered import Data, Remembered
from bench.reproduce.paper import PAPER, SMALL, PaperOptions, estimate_with_curves
from bench.stamp import PAPERS_VEHICLE, reached, stamp
from bench.words import blocks, paragraph, percent, table

SOURCES = (reached("bench/paper_network.py"), *PAPERS_VEHICLE)
CONFIGURATION = "survey"
HEAD = ("", "errors", "parameters settled at epoch", "own loss settled at epoch", "one epoch", "all epochs")


def page(cache: Path, seed: int) -> str:
    kept = Remembered(cache / f"paper_network-{stamp(*SOURCES)}.jsonl")
    return _words(kept.get(f"survey {seed}", lambda: _measured(seed, cache)))


def _measured(seed: int, cache: Path) -> Data:
    """Both networks and the closed form on one dive, one after the other."""
    survey = dived(CONFIGURATION, CONFIGURATION, seed, cache / "dives")
    begun = time.perf_counter()
    closed = closed_form.estimate(survey.dive, survey.file, CONFIGURATION, silent)
    return {
        "truth": {name: survey.truth[name] for name in closed.values() if name in survey.truth},
        "closed": dict(closed.values()),
        "closed seconds": time.perf_counter() - begun,
        "small": _trained(survey, SMALL),
        "whole": _trained(survey, PAPER),
    }


def _trained(survey: Dived, options: PaperOptions) -> Data:
    if options.device.type == "cuda":  # one epoch first, so that no start of the card is counted
        estimate_with_curves(survey.dive, survey.file, CONFIGURATION, silent, replace(options, epochs=1))
    network, curves = estimate_with_curves(survey.dive, survey.file, CONFIGURATION, silent, options)
    return {
        "values": dict(network.values()),
        "settled": curves.settled_at,
        "loss settled": curves.loss_settled_at,
        "epochs": options.epochs,
        "seconds": network.wall_s,
        "device": _name(options.device),
    }


def _name(device: torch.device) -> str:
    return torch.cuda.get_device_name(device) if device.type == "cuda" else "processor"


def _words(measured: Data) -> str:
    whole, small = measured["whole"], measured["small"]
    apart = max(abs(whole["values"][name] / small["values"][name] - 1.0) for name in measured["truth"])
    rows = [
        (
            f"{title}, on the {data['device']}",
            _errors(data["values"], measured["truth"]),
            f"{data['settled']}",
            f"{data['loss settled']}",
            f"{data['seconds'] / data['epochs']:.2g} s",
            f"{data['seconds']:.3g} s",
        )
        for title, data in (
            (f"network {PAPER.depth} x {PAPER.hidden}", whole),
            (f"network {SMALL.depth} x {SMALL.hidden}", small),
        )
    ]
    closed = _errors(measured["closed"], measured["truth"])
    rows.append(("closed form of the same loss", closed, "", "", "", f"{measured['closed seconds']:.2g} s"))
    return blocks(
        "## The paper's network, whole",
        paragraph(
            f"Algorithm 1 with the paper's own network, LSTM of {PAPER.depth} x {PAPER.hidden} (38.3 million weights),",
            f"for {PAPER.epochs} epochs on the paper's survey, as the simulated vehicle dives it. Errors against the",
            "truth in per cent. Settled: every parameter within 1 % of where it ends, the loss within 5 %. The two",
            f"networks end at most {percent(apart)} % apart.",
        ),
        table(HEAD, rows),
    )


def _errors(values: dict[str, float], truth: dict[str, float]) -> str:
    return ", ".join(f"{name} {100.0 * (values[name] / true - 1.0):+.2f}" for name, true in truth.items())
