"""`seatrial identify`: coefficients with intervals from dives."""

import argparse
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from bridge import exit_codes
from bridge.command_line import add_vehicle, size
from tui.pages import add_figures

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from bench.reproduce.paper import TrainingCurves
    from bridge.vehicle.config import VehicleFile
    from identify.dive import Dive
    from identify.estimators.table import Estimator
    from identify.identification import Identification
    from identify.progress import Progress
    from identify.run.identify import Identified
    from identify.run.recordings import Reading

EXAMPLE = "seatrial identify dives/2026-11-20T0912Z-hovering --vehicle ruvifist --json hovering.json"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "dives", nargs="+", metavar="DIVE", help="a dive folder, .tlog, .tlog.gz, .BIN or .csv"
    )
    add_vehicle(parser)
    parser.add_argument(
        "--method",
        metavar="METHOD[+METHOD]",
        help="likelihood, pinn or paper; two of them are compared (where not given: likelihood+pinn; "
        "likelihood where the vehicle file's damping is not linear)",
    )
    parser.add_argument(
        "--network",
        type=size,
        nargs=3,
        metavar=("HIDDEN", "DEPTH", "EPOCHS"),
        help="size and training of the paper's network: 1024 5 100 is the paper's own (small where not given)",
    )
    parser.add_argument("--columns", metavar="MAP", help="YAML map from the columns of a CSV to signals")
    parser.add_argument("--json", metavar="FILE", help="write the result as JSON; - for standard output")
    parser.add_argument("--param", metavar="FILE", help="write a .param with its sidecar, for one dive")
    parser.add_argument("--report", metavar="HTML", help="write a report with plots")
    add_figures(parser)


def run(arguments: argparse.Namespace) -> int:
    from bridge.vehicle.config import load_vehicle
    from gcs_plugin.params.files import sidecar_path
    from identify.identification import Outcome
    from identify.run.identify import usual_methods
    from identify.run.recordings import read
    from tui import pages, show
    from tui.answers import tell, tell_comparison
    from tui.files import PARAMETER_SUFFIXES, Files, check_file, check_files
    from tui.recordings import column_map_for, recording_at

    methods = methods_of(arguments.method)
    if arguments.param and len(arguments.dives) > 1:
        raise exit_codes.UsageError("--param takes what one dive tells; give one DIVE")
    if arguments.network and "paper" not in methods:
        raise exit_codes.UsageError("--network sizes the paper's network; give --method paper with it")
    targets = {"--json": arguments.json, "--param": arguments.param, "--report": arguments.report}
    if arguments.param:
        targets["the sidecar of --param"] = str(sidecar_path(Path(arguments.param)))
    check_files(targets)
    pages.check(arguments)
    check_file("--param", arguments.param, PARAMETER_SUFFIXES)
    file = load_vehicle(arguments.vehicle)
    columns = column_map_for(arguments.columns, arguments.dives)
    readings = [read(recording_at(Path(path)), file, columns) for path in arguments.dives]
    chosen = [reading.configuration for reading in readings]
    curves: dict[str, TrainingCurves] = {}
    if arguments.method is None:
        methods = usual_methods(file, chosen)
    estimates = {name: estimator_of(name, arguments.network, curves) for name in methods}
    result = [
        identified(reading, configuration, estimates)
        for reading, configuration in zip(readings, chosen, strict=True)
    ]
    results = [each.to_json() for each in result]
    console = show.results(arguments.json)
    with Files() as files:
        files.json(results[0] if len(results) == 1 else results, arguments.json)
        if arguments.param and result[0].answer.values():
            from gcs_plugin.params.identified import write_identified

            param = partial(write_identified, Path(arguments.param), results[0], file)
            files.attempt(param, f"parameters: {arguments.param}")
        # The page comes last because drawing takes long. It is written even if the reader of the table has left.
        try:
            for sentence in (remark for reading in readings for remark in reading.remarks):
                show.say(console, sentence)
            for each in result:
                tell(console, each.dive, each.answer)
                for comparison in each.comparisons:
                    tell_comparison(console, comparison)
        finally:
            if pages.wanted(arguments):
                from identify.report.identification import identification_report

                page = partial(identification_report, result, curves)
                pages.publish(files, arguments, page, [each.dive for each in result], file)
        for sentence in files.written:
            show.say(console, sentence)
    converged = all(each.answer.outcome is Outcome.CONVERGED for each in result)
    return files.code(exit_codes.DONE if converged else exit_codes.NO)


def methods_of(argument: str | None) -> tuple[str, ...]:
    """Return the method or the two methods that `--method` names. Raises UsageError for an unknown method."""
    from identify.estimators.table import METHODS, SIDE_BY_SIDE

    names = SIDE_BY_SIDE if argument is None else tuple(argument.split("+"))
    for name in names:
        if name not in (*METHODS, "paper"):
            raise exit_codes.UsageError(
                f"--method {argument}: no such method as '{name}'; give one of {', '.join(METHODS)}, paper, "
                "or two with a +"
            )
    if len(set(names)) != len(names) or len(names) > 2:
        raise exit_codes.UsageError(f"--method {argument}: give one method, or two different ones with a +")
    return names


def estimator_of(
    method: str, network: "Sequence[int] | None", curves: "dict[str, TrainingCurves]"
) -> "Estimator":
    """Return the estimator of a method; the paper's method leaves its training curves in `curves`."""
    from identify.estimators.table import estimator, judged

    return judged(paper(network, curves)) if method == "paper" else estimator(method)


def paper(network: "Sequence[int] | None", curves: "dict[str, TrainingCurves]") -> "Estimator":
    """Return the paper's method with a network of the given size; it stores its training curves in `curves` by dive."""
    from bench.reproduce.paper import SMALL, PaperOptions, estimate_with_curves
    from identify.estimators.table import refuse_damping

    options = (
        SMALL if network is None else PaperOptions(hidden=network[0], depth=network[1], epochs=network[2])
    )

    def estimate(
        dive: "Dive", file: "VehicleFile", configuration: str, progress: "Progress"
    ) -> "Identification":
        refuse_damping("paper", file, configuration)
        answer, curves[dive.sha256] = estimate_with_curves(dive, file, configuration, progress, options)
        return answer

    return estimate


def identified(reading: "Reading", configuration: str, estimates: "Mapping[str, Estimator]") -> "Identified":
    """Identify a dive by all estimators, each with its progress bar."""
    from identify.run.identify import identify
    from tui import show

    with show.bars({name: f"{name}: {reading.dive.name}" for name in estimates}) as progress:
        return identify(reading.dive, reading.file, configuration, estimates, progress)
