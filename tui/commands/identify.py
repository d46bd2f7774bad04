"""`seatrial identify`: coefficients with intervals from dives."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from tui import exit_codes, numbers

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rich.console import Console

    from bridge.vehicle.config import VehicleFile
    from identify.dive import Dive
    from identify.estimators.paper import TrainingCurves
    from identify.estimators.table import Estimator, Progress
    from identify.identification import Estimate, Identification

EXAMPLE = "seatrial identify dives/2026-11-20T0912Z-hovering --vehicle ruvifist --json hovering.json"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "dives", nargs="+", metavar="DIVE", help="a dive folder, .tlog, .tlog.gz, .BIN or .csv"
    )
    parser.add_argument(
        "--vehicle",
        required=True,
        metavar="FILE[:CONFIGURATION]",
        help="the vehicle file, or the name of one in configs/vehicles; the recording's VEH_CFG chooses the"
        " configuration where none is named",
    )
    parser.add_argument("--method", default="likelihood", help="likelihood (default) or paper")
    parser.add_argument(
        "--network",
        type=numbers.size,
        nargs=3,
        metavar=("HIDDEN", "DEPTH", "EPOCHS"),
        help="size and training of the paper's network: 1024 5 100 is the paper's own (small where not given)",
    )
    parser.add_argument("--columns", metavar="MAP", help="YAML map from the columns of a CSV to signals")
    parser.add_argument("--json", metavar="FILE", help="write the result as JSON; - for standard output")
    parser.add_argument("--param", metavar="FILE", help="write a .param with its sidecar, for one dive")
    parser.add_argument("--report", metavar="HTML", help="write a report with plots")


def run(arguments: argparse.Namespace) -> int:
    from bridge.vehicle.config import load_vehicle
    from identify.estimators.table import METHODS, estimator
    from identify.ingest.open import read_dive
    from tui import show
    from tui.outputs import PARAMETER_SUFFIXES, check_file, check_files

    if arguments.method not in METHODS:
        raise exit_codes.UsageError(
            f"--method {arguments.method}: no such method; give one of {', '.join(METHODS)}"
        )
    if arguments.param and len(arguments.dives) > 1:
        raise exit_codes.UsageError("--param takes what one dive tells; give one DIVE")
    if arguments.network and arguments.method != "paper":
        raise exit_codes.UsageError("--network sizes the paper's network; give --method paper with it")
    check_files({"--json": arguments.json, "--param": arguments.param, "--report": arguments.report})
    check_file("--param", arguments.param, PARAMETER_SUFFIXES)
    file = load_vehicle(arguments.vehicle)
    columns = Path(arguments.columns) if arguments.columns else None
    dives = [read_dive(Path(path), columns, file) for path in arguments.dives]
    chosen = [
        file.configuration or file.vehicle.configuration_at(dive.configuration_index()) for dive in dives
    ]
    curves: dict[str, TrainingCurves] = {}
    estimate = (
        paper(arguments.network, curves) if arguments.method == "paper" else estimator(arguments.method)
    )
    answers = [
        identify(dive, file, configuration, arguments.method, estimate)
        for dive, configuration in zip(dives, chosen, strict=True)
    ]
    console = show.results(arguments.json)
    for dive, answer in zip(dives, answers, strict=True):
        tell(console, dive, answer)
    found = [answer.to_json() for answer in answers]
    show.write_json(found[0] if len(found) == 1 else found, arguments.json)
    if arguments.param and answers[0].values():
        from tui.parameter_files import write_identified

        write_identified(Path(arguments.param), answers[0], file)
        show.say(console, f"parameters: {arguments.param}")
    if arguments.report:
        show.say(console, f"report: {report(Path(arguments.report), dives, file, answers, curves)}")
    return exit_codes.DONE if all(answer.values() for answer in answers) else exit_codes.NO


def paper(network: "Sequence[int] | None", curves: "dict[str, TrainingCurves]") -> "Estimator":
    """The paper's method with a network of its own size; its training curves go into `curves` by dive."""
    from identify.estimators.paper import SMALL, PaperOptions, estimate_with_curves

    options = (
        SMALL if network is None else PaperOptions(hidden=network[0], depth=network[1], epochs=network[2])
    )

    def estimate(
        dive: "Dive", file: "VehicleFile", configuration: str, progress: "Progress"
    ) -> "Identification":
        answer, curves[dive.sha256] = estimate_with_curves(dive, file, configuration, progress, options)
        return answer

    return estimate


def identify(
    dive: "Dive", file: "VehicleFile", configuration: str, method: str, estimate: "Estimator"
) -> "Identification":
    """One dive through one estimator, with a progress bar; a dive that holds too little for it says so."""
    from bridge.errors import FitError
    from tui import show

    with show.progress(f"identify {dive.name}") as progress:
        try:
            return estimate(dive, file, configuration, progress)
        except FitError as error:
            return nothing(dive, file, configuration, method, str(error))


def nothing(
    dive: "Dive", file: "VehicleFile", configuration: str, method: str, reason: str
) -> "Identification":
    """The answer where no parameter could be fitted, for one reason."""
    from bridge.vehicle.coefficients import COEFFICIENTS, MASSES
    from identify.identification import Identification, Outcome, added_mass, estimate

    nan = float("nan")
    totals = tuple(estimate(coefficient.name, nan, nan, nan, nan, reason) for coefficient in COEFFICIENTS)
    shape = file.vehicle.configurations[configuration]
    return Identification(
        method,
        Outcome.NOT_IDENTIFIABLE,
        (*totals, *(added_mass(total, shape) for total in totals[: len(MASSES)])),
        configuration,
        dive.name,
        dive.sha256,
        file.vehicle.name,
        file.sha256,
        dive.duration_s,
        0,
    )


def tell(console: "Console", dive: "Dive", answer: "Identification") -> None:
    """The result as a table, and what to know about it; where one reason left nothing to show, that reason."""
    from tui import show

    reasons = list(dict.fromkeys(p.reason for p in answer.parameters if not p.identifiable))
    title = f"{dive.name}: {answer.method}, configuration {answer.configuration}, {answer.outcome.value}"
    if len(reasons) == 1 and not any(p.identifiable for p in answer.parameters):
        show.say(console, f"{title}\n{reasons[0]}")
    else:
        show.put(
            console,
            show.table(
                title,
                ("name", "value", "low 95 %", "high 95 %", "unit", "identifiable"),
                [_row(parameter, reasons) for parameter in answer.parameters],
                numbers=("value", "low 95 %", "high 95 %"),
            ),
        )
        for number, reason in enumerate(reasons, start=1):
            show.say(console, f"{number}: {reason}")
    for note in dict.fromkeys((*dive.notes, *answer.sentences)):
        show.say(console, f"note: {note}")


def report(
    path: Path,
    dives: "Sequence[Dive]",
    file: "VehicleFile",
    answers: "Sequence[Identification]",
    curves: "Mapping[str, TrainingCurves]",
) -> Path:
    """The page with what was identified from each dive, and the dive itself."""
    from identify.report.page import Report, write_report
    from identify.report.sections import (
        dive_section,
        identification_section,
        innovations_section,
        training_section,
    )

    sections = []
    for dive, answer in zip(dives, answers, strict=True):
        sections.append(identification_section(answer))
        if dive.sha256 in curves:
            one = curves[dive.sha256]
            sections.append(training_section({name: one.values[:, i] for i, name in enumerate(one.names)}))
        if answer.innovations:
            sections.append(innovations_section(answer.innovations, dive.name))
        sections.append(dive_section(dive, file.vehicle.water))
    verdict = "; ".join(
        f"{dive.name} ({answer.configuration}): {len(answer.values())} of 12 coefficients identified, "
        f"{answer.outcome.value}"
        for dive, answer in zip(dives, answers, strict=True)
    )
    return write_report(
        path,
        Report(
            f"{file.vehicle.name}: {', '.join(dive.name for dive in dives)}",
            f"vehicle file {file.path.name}, method {answers[0].method}",
            f"{verdict}.",
            tuple(sections),
        ),
    )


def _row(parameter: "Estimate", reasons: "Sequence[str]") -> tuple[str, ...]:
    from tui import show

    values = (parameter.value, parameter.low95, parameter.high95)
    why = "yes" if parameter.identifiable else f"no, see {1 + reasons.index(parameter.reason)}"
    return parameter.name, *(show.number(value) for value in values), parameter.unit, why
