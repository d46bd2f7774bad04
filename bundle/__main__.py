"""`python -m bundle --out dist`, as `make bundle` runs it."""

import argparse
import itertools
import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from bundle.build import BundleError, build
from bundle.targets import SYSTEMS, Target

ROOT = Path(__file__).resolve().parents[1]


def pip(words: Sequence[str], flags: Sequence[str] = ()) -> str:
    """Run pip; return its last words if it fails."""
    verb, *options = words
    line = [sys.executable, "-m", "pip", "--disable-pip-version-check", verb, "--quiet", *flags, *options]
    done = subprocess.run(line, capture_output=True, text=True, check=False)
    errors = [text.removeprefix("ERROR: ") for text in done.stderr.splitlines() if text.startswith("ERROR")]
    return "" if done.returncode == 0 else (errors or [f"pip ended with {done.returncode}"])[-1]


def main(arguments: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(description="Make the archive that installs without a net.")
    parser.add_argument("--out", type=Path, default=ROOT / "dist", help="the folder that takes the archive")
    parser.add_argument(
        "--machines", default="x86_64 aarch64", help=f"of {', '.join(SYSTEMS)} (arm64: macOS)"
    )
    parser.add_argument("--pythons", default="3.11 3.12 3.13", help="versions of Python")
    parser.add_argument("--pip-flags", default="", help="further options of pip, such as another index")
    given = parser.parse_args(arguments)
    unknown = sorted(set(given.machines.split()) - set(SYSTEMS))
    if unknown:
        parser.error(f"unknown machine {', '.join(unknown)}; known are {', '.join(SYSTEMS)}")
    odd = [python for python in given.pythons.split() if not re.fullmatch(r"3\.\d+", python)]
    if odd:
        parser.error(f"unknown Python {', '.join(odd)}; name it as 3.11")
    targets = [Target(*pair) for pair in itertools.product(given.machines.split(), given.pythons.split())]
    if not targets:
        parser.error("name a machine and a version of Python at least")
    given.out.mkdir(parents=True, exist_ok=True)
    flags = given.pip_flags.split()
    try:
        made = build(ROOT, given.out, targets, lambda words: pip(words, flags), print)
    except BundleError as error:
        print(error, file=sys.stderr)
        return 1
    for sentence in made.left_out:
        print(f"left out: {sentence}", file=sys.stderr)
    print(f"{made.file}: {made.file.stat().st_size / 1e6:.0f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
