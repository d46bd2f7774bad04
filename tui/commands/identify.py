"""`seatrial identify`: coefficients with intervals from dives."""

import argparse
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from tui import exit_codes
from tui.arguments import add_vehicle, size
from tui.pages import add_figures

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from bench.reproduce.paper import TrainingCurves
    from bridge.vehicle.config import VehicleFile
    from identify.dive import Dive
    from identify.estimators.table import Estimator
    from identify.identification import Identification
    from identify.progress import Progress
    from identify.report.page import Report
    from identify.run import Identified, Step

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
    from identify.ingest.open import read_dive
    from identify.run import usual_methods
    from tui import pages, show
    from tui.answers import tell, tell_comparison
    from tui.files import PARAMETER_SUFFIXES, Files, check_file, check_files
    from tui.recordings import column_map_for, under_conditions

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
    held = [under_conditions(file, Path(path)) for path in arguments.dives]
    held_files = [held_file for held_file, _ in held]
    dives = [
        read_dive(Path(path), columns, held_file)
        for path, held_file in zip(arguments.dives, held_files, strict=True)
    ]
    chosen = [file.configuration_of(dive.configuration_index()) for dive in dives]
    curves: dict[str, TrainingCurves] = {}
    if arguments.method is None:
        methods = usual_methods(file, chosen)
    estimates = {name: estimator_of(name, arguments.network, curves) for name in methods}
    found = [
        identified(dive, held_file, configuration, estimates)
        for dive, held_file, configuration in zip(dives, held_files, chosen, strict=True)
    ]
    results = [
        one.answer.to_json() | ({"comparison": one.comparisons[0].to_json()} if one.comparisons else {})
        for one in found
    ]
    console = show.results(arguments.json)
    with Files() as files:
        files.json(results[0] if len(results) == 1 else results, arguments.json)
        if arguments.param and found[0].answer.values():
            from tui.parameter_files import write_identified

            param = partial(write_identified, Path(arguments.param), found[0].answer, file)
            files.attempt(param, f"parameters: {arguments.param}")
        # The page comes last because drawing takes long. It is written even if the reader of the table has left.
        try:
            for _, sentences in held:
                for sentence in sentences:
                    show.say(console, sentence)
            for one in found:
                tell(console, one.dive, one.answer)
                for comparison in one.comparisons:
                    tell_comparison(console, comparison)
        finally:
            if pages.wanted(arguments):
                page = partial(report, found, curves)
                pages.publish(files, arguments, page, dives, file)
        for sentence in files.written:
            show.say(console, sentence)
    converged = all(one.answer.outcome is Outcome.CONVERGED for one in found)
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


def identified(
    dive: "Dive", file: "VehicleFile", configuration: str, estimates: "Mapping[str, Estimator]"
) -> "Identified":
    """Identify a dive by all estimators, each with its progress bar."""
    from identify.run import identify
    from tui import show

    with show.bars({name: f"{name}: {dive.name}" for name in estimates}) as tells:
        tell_of = dict(zip(estimates, tells, strict=True))

        def passed_on(step: "Step") -> None:
            tell_of[step.method](step.share, step.words, step.values, step.answered)

        return identify(dive, file, configuration, estimates, passed_on)


def _asked(answer: "Identification") -> int:
    """Number of coefficients in the model of an answer."""
    from bridge.vehicle.coefficients import OF_HULL

    return sum(parameter.name in OF_HULL for parameter in answer.parameters)


def report(found: "Sequence[Identified]", curves: "Mapping[str, TrainingCurves]") -> "Report":
    """Return the page with the results of each dive and the dives themselves."""
    from identify.report.page import Report
    from identify.report.sections import (
        comparison_section,
        dive_section,
        identification_section,
        innovations_section,
        training_section,
    )

    sections = []
    for one in found:
        sections.append(identification_section(one.answer))
        for comparison in one.comparisons:
            sections += [comparison_section(comparison), identification_section(comparison.second)]
        if one.dive.sha256 in curves:
            trained = curves[one.dive.sha256]
            values = {name: trained.values[:, i] for i, name in enumerate(trained.names)}
            sections.append(training_section(values))
        if one.answer.innovations:
            sections.append(innovations_section(one.answer.innovations, one.dive.name))
        sections.append(dive_section(one.dive, one.file.vehicle.water))
    methods = [found[0].answer.method, *(comparison.second.method for comparison in found[0].comparisons)]
    verdict = "; ".join(
        f"{one.dive.name} ({one.answer.configuration}): {len(one.answer.values())} of {_asked(one.answer)} "
        f"coefficients identified, {one.answer.outcome.value}"
        for one in found
    )
    file = found[-1].file
    return Report(
        f"{file.vehicle.name}: {', '.join(one.dive.name for one in found)}",
        f"vehicle file {file.path.name}, method {' beside '.join(methods)}",
        f"{verdict}.",
        tuple(sections),
    )
