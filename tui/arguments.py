"""Arguments that several commands share, and the types of numbers, checked before anything begins."""

import argparse
from collections.abc import Iterator, Mapping

PAPER = "bench.reproduce.paper"
"""Module of the source paper's method, which `identify` and `batch` offer beside their own as `paper`."""


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
