"""Arguments that several commands share, and the types of numbers, checked before anything begins."""

import argparse
import math
from collections.abc import Iterator, Mapping

PAPER = "bench.reproduce.paper"
"""Module of the source paper's method, which `identify` and `batch` offer beside their own as `paper`."""


def seconds(text: str) -> float:
    """A positive number of seconds."""
    value = _number(text)
    if not value > 0:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number of seconds above 0")
    return value


def above_zero(text: str) -> float:
    """A positive number."""
    value = _number(text)
    if not value > 0:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number above 0")
    return value


def seed(text: str) -> int:
    """A whole number from 0."""
    return _whole(text, 0)


def size(text: str) -> int:
    """A whole number from 1."""
    return _whole(text, 1)


def port(text: str) -> int:
    """A TCP or UDP port; 0 means any free port."""
    value = _whole(text, 0)
    if value > 65535:
        raise argparse.ArgumentTypeError(f"'{text}' is no port; give a number up to 65535")
    return value


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    return value if math.isfinite(value) else math.nan


def _whole(text: str, least: int) -> int:
    try:
        value = int(text)
    except ValueError:
        value = least - 1
    if value < least:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number from {least}")
    return value


def add_vehicle(parser: argparse.ArgumentParser) -> None:
    """Add `--vehicle`, the vehicle file of a dive."""
    parser.add_argument(
        "--vehicle",
        required=True,
        metavar="FILE[:CONFIGURATION]",
        help="the vehicle file, or the name of one in configs/vehicles; the recording's VEH_CFG chooses the"
        " configuration where none is named",
    )


def actions_of(
    parser: argparse.ArgumentParser, actions: Mapping[str, tuple[str, str]]
) -> Iterator[tuple[str, argparse.ArgumentParser]]:
    """Add and yield a parser for each action of a command, by name; `actions` has a sentence and an example each."""
    parsers = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    for name, (sentence, example) in actions.items():
        yield (
            name,
            parsers.add_parser(
                name,
                help=sentence,
                description=f"{sentence[0].upper()}{sentence[1:]}.",
                epilog=f"example:\n  {example}",
                formatter_class=argparse.RawDescriptionHelpFormatter,
            ),
        )
