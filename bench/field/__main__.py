"""`python -m bench.field make` writes field dives as folders, `score` diagnoses such folders and prints the tables."""

import argparse
import hashlib
import sys
import tempfile
from functools import partial
from pathlib import Path

from bench.remembered import Remembered
from bench.stamp import stamp
from bridge.command_line import seed


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench.field", description=__doc__)
    commands = parser.add_subparsers(required=True, metavar="make | score")
    make = commands.add_parser("make", help="write dives as folders")
    make.add_argument("--seed", type=seed, required=True)
    make.add_argument("--count", type=int, required=True)
    make.add_argument("--out", type=Path, required=True)
    make.set_defaults(run=_make)
    score = commands.add_parser(
        "score", help="diagnose dives in folders, two at a time, and print the tables"
    )
    score.add_argument(
        "folders", type=Path, nargs="+", metavar="DIR", help="a dive's folder, or one that holds such"
    )
    score.add_argument("--kept", type=Path, help="a file of JSON lines: what is in it is not diagnosed again")
    score.set_defaults(run=partial(_score, score))
    arguments = parser.parse_args()
    arguments.run(arguments)


def _make(arguments: argparse.Namespace) -> None:
    from bench.field.draw import draw, plan

    for number, effect in plan(arguments.seed, arguments.count):
        case = draw(arguments.seed, number, effect)
        folder = arguments.out / case.name
        folder.mkdir(parents=True, exist_ok=True)
        for name, data in case.files().items():
            (folder / name).write_bytes(data)
        over = case.felt().size if case.planted else 0.0
        sys.stdout.write(f"{case.name} {case.effect}: {over:.2f} over the sea\n")
        sys.stdout.flush()


def _score(parser: argparse.ArgumentParser, arguments: argparse.Namespace) -> None:
    from bench.field.answers import SOURCES, folder_job
    from bench.field.score import judged
    from bench.field.section import lines

    folders = [place.parent for folder in arguments.folders for place in sorted(folder.glob("**/truth.yaml"))]
    if not folders:
        parser.error(f"there is no dive in {', '.join(map(str, arguments.folders))}; `make` writes some")
    with tempfile.TemporaryDirectory() as spare:
        kept = Remembered(arguments.kept or Path(spare) / "kept.jsonl")
        jobs = {
            f"{folder.resolve()}:{_digest(folder)}:{stamp(*SOURCES)}": partial(folder_job, folder)
            for folder in folders
        }
        cases = [judged(data) for data in kept.fill(jobs, "field dives").values()]
        sys.stdout.write("\n".join([*lines(cases), ""]))


def _digest(folder: Path) -> str:
    """Ten hexadecimal digits of a dive's files: another dive may be made in its folder."""
    texts = (path.read_bytes() for path in sorted(folder.iterdir()) if path.is_file())
    return hashlib.sha256(b"".join(texts)).hexdigest()[:10]


if __name__ == "__main__":
    main()
