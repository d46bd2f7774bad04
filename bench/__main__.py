"""`make bench`: every measurement, into docs/benchmarks.md. Resumes where it stopped (runs/)."""

import argparse
from pathlib import Path

from rich.progress import track

from bench import coverage, paper_noise

ROOT = Path(__file__).resolve().parents[1]


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench", description=__doc__)
    parser.add_argument("--seeds", type=int, default=40, help="seeds of the coverage (default: 40)")
    arguments = parser.parse_args()
    cache = ROOT / "runs" / "coverage.jsonl"
    cache.parent.mkdir(exist_ok=True)
    whole = coverage.trials(range(1, arguments.seeds + 1), cache)
    found = list(track(whole, "coverage", total=14 * arguments.seeds))
    docs = ROOT / "docs"
    sections = [coverage.page(found), paper_noise.page(docs / "paper_noise.html")]
    head = "# Benchmarks\n\nWritten by `make bench`; every figure here comes from it.\n\n"
    (docs / "benchmarks.md").write_text(head + "\n".join(sections), encoding="utf-8")


if __name__ == "__main__":
    main()
