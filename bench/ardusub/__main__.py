"""`python -m bench.ardusub CASE ...`: measure some cases into runs/, for `python -m bench ardusub` to write down."""

import argparse

from bench.ardusub.cases import CASES
from bench.ardusub.firmware import WHY_NOT, firmware_path
from bench.ardusub.page import FOLLOWING, PLANNED, measured
from bench.stamp import ROOT


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench.ardusub", description=__doc__)
    parser.add_argument("cases", nargs="+", choices=(*CASES, PLANNED, FOLLOWING))
    arguments = parser.parse_args()
    path = firmware_path()
    if path is None:
        parser.error(WHY_NOT)
    folder = ROOT / "runs" / "ardusub"
    folder.mkdir(parents=True, exist_ok=True)
    for name in arguments.cases:
        measured(path, folder, name)


if __name__ == "__main__":
    main()
