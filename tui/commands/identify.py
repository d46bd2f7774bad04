"""`seatrial identify`: coefficients with intervals from dives."""

import argparse
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from tui import exit_codes, numbers
from tui.arguments import add_vehicle
from tui.pages import add_figures

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from bridge.vehicle.config import VehicleFile
    from identify.comparison import Comparison
    from identify.dive import Dive
    from identify.estimators.paper import TrainingCurves
    from identify.estimators.table import Estimator
    from identify.identification import Identification
    from identify.progress import Progress, Values
    from identify.report.page import Report
    from tui.show import Tell

DONE = "done"
"""Last words of an estimator that has nothing more to report."""

ANSWERED = "answered"
"""Reported of a method once it is done, with its values."""

FITTED, JUDGED = 0.99, "weighing what speaks against its values"
"""Progress once all is fitted: the doubts about the values are still being assessed, which takes a while."""

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
        type=numbers.size,
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
    from gcs_plugin.params.sidecar import sidecar_path
    from identify.comparison import compare, doubted
    from identify.identification import Outcome
    from identify.ingest.open import read_dive
    from tui import pages, show
    from tui.columns import column_map_for
    from tui.files import Files
    from tui.identified import tell, tell_comparison
    from tui.outputs import PARAMETER_SUFFIXES, check_file, check_files
    from tui.under_conditions import under_conditions

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
        methods = _usual(file, chosen)
    estimates = {name: estimator_of(name, arguments.network, curves) for name in methods}
    answers, compared = [], []
    for dive, held_file, configuration in zip(dives, held_files, chosen, strict=True):
        first, *seconds = side_by_side(dive, held_file, configuration, estimates)
        priors = file.vehicle.configurations[configuration].priors
        dive_comparisons = [compare(first, second, priors) for second in seconds]
        answers.append(doubted(dive_comparisons[0]) if dive_comparisons else first)
        compared.append(dive_comparisons)
    results = [
        answer.to_json() | ({"comparison": comparisons[0].to_json()} if comparisons else {})
        for answer, comparisons in zip(answers, compared, strict=True)
    ]
    console = show.results(arguments.json)
    with Files() as files:
        files.json(results[0] if len(results) == 1 else results, arguments.json)
        if arguments.param and answers[0].values():
            from tui.parameter_files import write_identified

            param = partial(write_identified, Path(arguments.param), answers[0], file)
            files.attempt(param, f"parameters: {arguments.param}")
        # The page comes last because drawing takes long. It is written even if the reader of the table has left.
        try:
            for _, sentences in held:
                for sentence in sentences:
                    show.say(console, sentence)
            for dive, answer, comparisons in zip(dives, answers, compared, strict=True):
                tell(console, dive, answer)
                for comparison in comparisons:
                    tell_comparison(console, comparison)
        finally:
            if pages.wanted(arguments):
                page = partial(report, dives, held_files, answers, compared, curves)
                pages.publish(files, arguments, page, dives, file)
        for sentence in files.written:
            show.say(console, sentence)
    converged = all(answer.outcome is Outcome.CONVERGED for answer in answers)
    return files.code(exit_codes.DONE if converged else exit_codes.NO)


def _usual(file: "VehicleFile", configurations: "Sequence[str]") -> tuple[str, ...]:
    """Return the default methods: two side by side for linear damping of all these hulls, else those for quadratic."""
    from identify.estimators.table import OF_QUADRATIC, SIDE_BY_SIDE

    linear = all(file.vehicle.configurations[name].damping == "linear" for name in configurations)
    return SIDE_BY_SIDE if linear else OF_QUADRATIC


def methods_of(argument: str | None) -> tuple[str, ...]:
    """Return the method or the two methods that `--method` names. Raises UsageError for an unknown method."""
    from identify.estimators.table import METHODS, SIDE_BY_SIDE

    names = SIDE_BY_SIDE if argument is None else tuple(argument.split("+"))
    for name in names:
        if name not in METHODS:
            raise exit_codes.UsageError(
                f"--method {argument}: no such method as '{name}'; give one of {', '.join(METHODS)}, or two with a +"
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
    from identify.estimators.paper import SMALL, PaperOptions, estimate_with_curves
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


def side_by_side(
    dive: "Dive", file: "VehicleFile", configuration: str, estimates: "Mapping[str, Estimator]"
) -> "tuple[Identification, ...]":
    """Run one dive through all estimators at the same time, each with its progress bar."""
    from identify.together import together
    from tui import show

    with show.bars({name: f"{name}: {dive.name}" for name in estimates}) as tells:
        works = [
            partial(identify, dive, file, configuration, name, estimate, tell)
            for (name, estimate), tell in zip(estimates.items(), tells, strict=True)
        ]
        return together(works)


def identify(
    dive: "Dive",
    file: "VehicleFile",
    configuration: str,
    method: str,
    estimate: "Estimator",
    progress: "Tell",
) -> "Identification":
    """Run one dive through one estimator; a dive with too little information gives an answer that says so.

    The estimator's last message about how it ended is kept as a note, unless it is only "done".
    """
    from dataclasses import replace

    from bridge.errors import FitError
    from identify.progress import NO_VALUES

    ends: list[str] = []

    def passed_on(share: float, words: str, values: "Values" = NO_VALUES, /) -> None:
        if share >= 1.0 and words != DONE:
            ends.append(f"{words[0].upper()}{words[1:]}.")
        if share >= 1.0:
            share, words, values = FITTED, JUDGED, NO_VALUES
        progress(share, words, values)

    try:
        answer = estimate(dive, file, configuration, passed_on)
    except FitError as error:
        # The report names the dive itself.
        answer = nothing(dive, file, configuration, method, error.reason)
    progress(1.0, ANSWERED, values_of(answer), True)
    return replace(answer, notes=(*answer.notes, *ends[-1:]))


def values_of(answer: "Identification") -> "Values":
    """Return the identifiable parameters of a finished method with half of their 95 % intervals, in SI units."""
    from bridge.vehicle.coefficients import OF_HULL

    return {
        parameter.name: (parameter.value, (parameter.high95 - parameter.low95) / 2)
        for parameter in answer.parameters
        if parameter.identifiable and parameter.name in OF_HULL
    }


def _asked(answer: "Identification") -> int:
    """Number of coefficients in the model of an answer."""
    from bridge.vehicle.coefficients import OF_HULL

    return sum(parameter.name in OF_HULL for parameter in answer.parameters)


def nothing(
    dive: "Dive", file: "VehicleFile", configuration: str, method: str, reason: str
) -> "Identification":
    """Return an answer in which no parameter could be fitted, all for the same reason."""
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


def report(
    dives: "Sequence[Dive]",
    files: "Sequence[VehicleFile]",
    answers: "Sequence[Identification]",
    compared: "Sequence[Sequence[Comparison]]",
    curves: "Mapping[str, TrainingCurves]",
) -> "Report":
    """Return the page with the results of each dive and the dives themselves."""
    from identify.report.compared import comparison_section
    from identify.report.page import Report
    from identify.report.sections import (
        dive_section,
        identification_section,
        innovations_section,
        training_section,
    )

    sections = []
    for dive, file, answer, comparisons in zip(dives, files, answers, compared, strict=True):
        sections.append(identification_section(answer))
        for comparison in comparisons:
            sections += [comparison_section(comparison), identification_section(comparison.second)]
        if dive.sha256 in curves:
            trained = curves[dive.sha256]
            values = {name: trained.values[:, i] for i, name in enumerate(trained.names)}
            sections.append(training_section(values))
        if answer.innovations:
            sections.append(innovations_section(answer.innovations, dive.name))
        sections.append(dive_section(dive, file.vehicle.water))
    methods = [answers[0].method, *(comparison.second.method for comparison in compared[0])]
    verdict = "; ".join(
        f"{dive.name} ({answer.configuration}): {len(answer.values())} of {_asked(answer)} coefficients identified, "
        f"{answer.outcome.value}"
        for dive, answer in zip(dives, answers, strict=True)
    )
    return Report(
        f"{file.vehicle.name}: {', '.join(dive.name for dive in dives)}",
        f"vehicle file {file.path.name}, method {' beside '.join(methods)}",
        f"{verdict}.",
        tuple(sections),
    )
