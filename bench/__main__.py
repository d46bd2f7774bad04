"""`make bench`: measurements, into docs/benchmarks.md. Resumes where it stopped (runs/).

Name sections to run those alone; the others stay on the page, those of code that has changed since labelled so.
"""

import argparse

from bench.document import Section, compared, read, timed, wall_s, written
from bench.sections import SECTIONS, Run
from bench.stamp import ROOT, afresh
from bridge.files import write_whole


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench", description=__doc__)
    asked = [name for name, measurement in SECTIONS.items() if measurement.asked]
    parser.add_argument(
        "sections",
        nargs="*",
        metavar="SECTION",
        help=f"of {', '.join(SECTIONS)} (default: all but {', '.join(asked)})",
    )
    parser.add_argument("--short", action="store_true", help="fewer seeds: 100 missions for the accuracy")
    arguments = parser.parse_args()
    unknown = [name for name in arguments.sections if name not in SECTIONS]
    if unknown:
        parser.error(f"there is no section {', '.join(unknown)}; there are {', '.join(SECTIONS)}")
    run = Run(ROOT / "runs", ROOT / "docs", ROOT / "bench" / "results", arguments.short)
    run.cache.mkdir(exist_ok=True)
    target = run.docs / "benchmarks.md"
    # Taken before the first measurement: if code changes meanwhile, the figures don't count for the code after.
    codes = {name: measurement.code for name, measurement in SECTIONS.items()}
    for name in arguments.sections or [name for name in SECTIONS if name not in asked]:
        with timed(run.cache / "bench", name, codes[name]):
            text = SECTIONS[name].page(run)
        # Written after each section, so that its result is on the page even if a later section fails.
        sections = read(target.read_text(encoding="utf-8")) if target.exists() else {}
        took_s = wall_s(run.cache / "bench", name, codes[name])
        page = Section(text, codes[name], wall_s=took_s, asked=name in asked)
        now = {other: afresh(*measurement.sources) for other, measurement in SECTIONS.items()}
        text = written(compared({**sections, name: page}, now), tuple(SECTIONS))
        write_whole(target, text)


if __name__ == "__main__":
    main()
