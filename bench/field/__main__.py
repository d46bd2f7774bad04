"""`python -m bench.field make`: field dives as folders."""

import argparse
from pathlib import Path

from bench.field.draw import draw, plan


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench.field", description=__doc__)
    commands = parser.add_subparsers(required=True)
    make = commands.add_parser("make", help="write dives as folders")
    make.add_argument("--seed", type=int, required=True)
    make.add_argument("--count", type=int, required=True)
    make.add_argument("--out", type=Path, required=True)
    make.set_defaults(run=_make)
    arguments = parser.parse_args()
    arguments.run(arguments)


def _make(arguments: argparse.Namespace) -> None:
    for number, effect in plan(arguments.seed, arguments.count):
        case = draw(arguments.seed, number, effect)
        folder = arguments.out / case.name
        folder.mkdir(parents=True, exist_ok=True)
        for name, data in case.files().items():
            (folder / name).write_bytes(data)
        print(f"{case.name} {case.effect} size {case.size:.2f} over the sea {case.felt().size:.2f}", flush=True)


if __name__ == "__main__":
    main()
