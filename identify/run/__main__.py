"""`python -m identify.run identify|diagnose DIVE ...`: one function on a dive, for a program without our terminal.

Steps and errors go to standard output as lines of JSON (`bridge.reports`), the result goes into the file of `--json`.
Exit codes: 0 done, 1 the answer is to be read before its values are used, 2 bad input, 4 stopped.
"""

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bridge.errors import FitError, SeatrialError
from bridge.files import write_whole
from bridge.plain import to_json
from bridge.reports import ERROR, PAGE, Report, line
from bridge.vehicle.config import load_vehicle
from identify.progress import Step
from identify.run.recordings import Reading, Recording, read

DONE, NO, BAD_INPUT, STOPPED = 0, 1, 2, 4


def main(words: Sequence[str]) -> int:
    # Set before numpy is imported: matrices are small here, and a second thread would spin on another method's core.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    arguments = _parser().parse_args(words)
    try:
        return _identify(arguments) if arguments.function == "identify" else _diagnose(arguments)
    except (SeatrialError, OSError) as error:
        tell(Report(ERROR, 1.0, str(error), type(error).__name__))
        return NO if isinstance(error, FitError) else BAD_INPUT
    except KeyboardInterrupt:
        return STOPPED


def tell(report: Report) -> None:
    """Write a report for the program that reads along."""
    # A single write per line, since several threads may report at once.
    sys.stdout.write(line(report))
    sys.stdout.flush()


def step(taken: Step) -> None:
    tell(Report(taken.of, taken.share, taken.words, "", dict(taken.values), taken.answered))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m identify.run")
    parser.add_argument("function", choices=("identify", "diagnose"))
    parser.add_argument("dive", type=Path)
    parser.add_argument("--vehicle", required=True)
    parser.add_argument("--json", type=Path, required=True)
    parser.add_argument("--report", type=Path)
    parser.add_argument("--columns")
    parser.add_argument("--method")
    parser.add_argument("--check", type=Path)
    parser.add_argument("--without", action="append", default=[])
    parser.add_argument("--in-force", type=Path, help="sidecar of the model that the vehicle flew with")
    parser.add_argument("--since", default="", help="when that was uploaded, UTC")
    for dive in ("", "check-"):
        parser.add_argument(f"--{dive}density", type=float, help="of the water, kg/m3")
        parser.add_argument(f"--{dive}carried", type=float, default=0.0, help="kg")
    return parser


def _identify(arguments: argparse.Namespace) -> int:
    from identify.doubt import Outcome
    from identify.estimators.table import estimator
    from identify.report.identification import identification_report
    from identify.run.identify import identify

    reading = _read(arguments, arguments.dive, arguments.density, arguments.carried)
    methods = None
    if arguments.method:
        methods = {name: estimator(name) for name in arguments.method.split("+")}
    done = identify(reading.dive, reading.file, reading.configuration, methods, step)
    _write(arguments.json, done.to_json())
    _draw(arguments, lambda: identification_report([done], {}), [reading])
    return DONE if done.answer.outcome is Outcome.CONVERGED else NO


def _diagnose(arguments: argparse.Namespace) -> int:
    from identify.report.diagnosis import diagnosis_report
    from identify.run.diagnose import Before, diagnose
    from identify.run.in_force import read_in_force

    readings = [_read(arguments, arguments.dive, arguments.density, arguments.carried)]
    if arguments.check:
        readings.append(_read(arguments, arguments.check, arguments.check_density, arguments.check_carried))
    file, configuration = readings[0].file, readings[0].configuration
    shape = file.vehicle.configurations[configuration]
    before = Before()
    if arguments.in_force is not None:
        before = read_in_force(arguments.in_force, arguments.since, shape, configuration)
    done = diagnose(
        readings[0].dive,
        file,
        configuration,
        check=readings[1].dive if arguments.check else None,
        check_file=readings[1].file if arguments.check else None,
        without=arguments.without,
        before=before,
        notes=[f"{remark}." for reading in readings for remark in reading.remarks],
        progress=step,
    )
    _write(arguments.json, done.to_json())
    _draw(arguments, lambda: diagnosis_report(done.diagnosis), readings)
    return DONE


def _read(arguments: argparse.Namespace, dive: Path, density: float | None, carried: float) -> Reading:
    columns = Path(arguments.columns) if arguments.columns else None
    return read(Recording(dive, density, carried), load_vehicle(arguments.vehicle), columns)


def _write(path: Path, data: Any) -> None:
    write_whole(path, f"{to_json(data, indent=2)}\n", synced=True)


def _draw(arguments: argparse.Namespace, report: Any, readings: Sequence[Reading]) -> None:
    """Write the page, if one is wanted; drawing takes long."""
    if arguments.report is None:
        return
    from identify.report.page import with_provenance, write_report

    tell(Report(PAGE, 0.0, "writing the page"))
    settings = {"vehicle": arguments.vehicle, "method": arguments.method or "the usual"}
    page = with_provenance(report(), [reading.dive for reading in readings], readings[0].file, settings)
    write_report(arguments.report, page, lambda share: tell(Report(PAGE, share, "writing the page")))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
