"""`seatrial identify`: coefficients with intervals from dives."""

import argparse
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from bridge import exit_codes
from bridge.vehicle.config import VehicleFile, load_vehicle
from gcs_plugin.params.identified import write_identified
from identify.dive import Dive
from identify.doubt import Outcome
from identify.estimators.comparison import Comparison, further_remarks
from identify.estimators.table import (
    DEFAULT,
    METHODS,
    SIDE_BY_SIDE,
    Estimator,
    estimator,
    judged,
    refuse_damping,
)
from identify.identification import Estimate, Identification
from identify.progress import Progress
from identify.run.identify import Identified, identify, usual_methods
from identify.run.recordings import Reading, read
from identify.run.repeats import usual_in
from tui import show
from tui.files import Files
from tui.recordings import column_map_for, each_alone, read_together, recording_at

if TYPE_CHECKING:
    from bench.reproduce.paper import TrainingCurves
    from identify.report.page import Report


COLUMNS = ("name", "value", "95 % low", "95 % high")
STD_COLUMN, GIVEN_COLUMN = "std, %", "std given thrust, %"
PRIOR_COLUMN = "prior, %"
LAST_COLUMN = "identifiable"


def run(arguments: argparse.Namespace) -> int:
    methods = methods_of(arguments.method)
    if arguments.param and len(arguments.dives) > 1 and not arguments.together:
        raise exit_codes.UsageError(
            "--param takes what one dive tells; give one DIVE, or --together if all are runs of one"
        )
    if arguments.network and "paper" not in methods:
        raise exit_codes.UsageError("--network sizes the paper's network; give --method paper with it")
    file = load_vehicle(arguments.vehicle)
    columns = column_map_for(arguments.columns, arguments.dives)
    if arguments.together:
        methods = method_together(arguments.method)
        readings = [read_together(arguments.dives, file, columns)]
    else:
        readings = [read(recording_at(path), file, columns) for path in each_alone(arguments.dives)]
    chosen = [reading.configuration for reading in readings]
    curves: dict[str, TrainingCurves] = {}
    if arguments.method is None and not arguments.together:
        methods = usual_methods(file, chosen)
    estimates = {name: estimator_of(name, arguments.network, curves) for name in methods}
    result = [
        identified(reading, configuration, estimates)
        for reading, configuration in zip(readings, chosen, strict=True)
    ]
    results = [each.to_json() for each in result]
    usual = usual_in(readings[0].dive, readings[0].file, chosen[0]) if arguments.together else None
    if usual is not None:
        results[0]["repeats"] = usual.to_json()
    console = show.results(arguments.json)
    with Files() as files:
        files.json(results[0] if len(results) == 1 else results, arguments.json)
        if arguments.param and result[0].answer.values():
            param = partial(write_identified, Path(arguments.param), results[0], file)
            files.attempt(param, f"parameters: {arguments.param}")
        # The page comes last because drawing takes long. It is written even if the reader of the table has left.
        try:
            show.say(console, *(remark for reading in readings for remark in reading.remarks))
            for each in result:
                tell(console, each.dive, each.answer)
                for comparison in each.comparisons:
                    tell_comparison(console, comparison)
            if usual is not None and arguments.json:
                show.say(
                    console,
                    f"note: {usual.count} runs go from rest into one steady push; `diagnose --accepted` judges further "
                    "ones by what these have in common.",
                )
        finally:
            page = partial(page_of, result, curves)
            files.publish(arguments, page, [each.dive for each in result], file)
        show.say(console, *files.written)
    converged = all(each.answer.outcome is Outcome.CONVERGED for each in result)
    return files.code(exit_codes.DONE if converged else exit_codes.NO)


def page_of(results: Sequence[Identified], curves: "Mapping[str, TrainingCurves]") -> "Report":
    """Return the report of dives, with the paper's training curves by dive."""
    from identify.report.identification import identification_report  # loads matplotlib

    return identification_report(
        results, {dive: dict(zip(of.names, of.values.T, strict=True)) for dive, of in curves.items()}
    )


def methods_of(argument: str | None) -> tuple[str, ...]:
    """Return the method or the two methods that `--method` names. Raises UsageError for an unknown method."""
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


def method_together(argument: str | None) -> tuple[str, ...]:
    """The method for several runs. Raises UsageError if `--method` names another."""
    if argument not in (None, DEFAULT):
        raise exit_codes.UsageError(
            f"--method {argument}: several runs together are identified by {DEFAULT} alone; leave --method out"
        )
    return (DEFAULT,)


def estimator_of(
    method: str, network: Sequence[int] | None, curves: "dict[str, TrainingCurves]"
) -> Estimator:
    """Return the estimator of a method; the paper's method leaves its training curves in `curves`."""
    return judged(paper(network, curves)) if method == "paper" else estimator(method)


def paper(network: Sequence[int] | None, curves: "dict[str, TrainingCurves]") -> Estimator:
    """Return the paper's method with a network of the given size; it stores its training curves in `curves` by dive."""
    from bench.reproduce.paper import estimate_with_curves, sized

    def estimate(dive: Dive, file: VehicleFile, configuration: str, progress: Progress) -> Identification:
        refuse_damping("paper", file, configuration)
        answer, curves[dive.sha256] = estimate_with_curves(
            dive, file, configuration, progress, sized(network)
        )
        return answer

    return estimate


def identified(reading: Reading, configuration: str, estimates: Mapping[str, Estimator]) -> Identified:
    """Identify a dive by all estimators, each with its progress bar."""
    with show.bars({name: f"{name}: {reading.dive.name}" for name in estimates}) as progress:
        return identify(reading.dive, reading.file, configuration, estimates, progress)


def tell(console: Console, dive: Dive, answer: Identification) -> None:
    """Show the result as a table with its notes; if a single reason left nothing to show, only that reason."""
    reasons = list(dict.fromkeys(p.reason for p in answer.parameters if not p.identifiable))
    title = f"{dive.name}: {answer.method}, configuration {answer.configuration}, {answer.outcome.value}"
    if len(reasons) == 1 and not any(p.identifiable for p in answer.parameters):
        show.say(console, f"{title}\n{reasons[0]}")
    else:
        priors = any(p.share_from_prior for p in answer.parameters)
        # Next to an interval that holds the thrust's uncertainty stands the error without it.
        std = GIVEN_COLUMN if any(p.scale_std > 0 for p in answer.parameters) else STD_COLUMN
        columns = (
            *COLUMNS,
            "unit",
            std,
            "strongest partner",
            *((PRIOR_COLUMN,) if priors else ()),
            LAST_COLUMN,
        )
        rows = [_row(parameter, reasons, priors) for parameter in answer.parameters]
        numbers = ("value", "95 % low", "95 % high", std, PRIOR_COLUMN)
        show.put(console, show.Table(title, columns, rows, numbers))
        for number, reason in enumerate(reasons, start=1):
            show.say(console, f"{number}: {reason}")
    doubts = [doubt.sentence for doubt in answer.doubts]
    show.say(console, *(f"warning: {doubt}" for doubt in dict.fromkeys(doubts)))
    for note in dict.fromkeys((*answer.sentences, *dive.notes)):
        if note not in doubts:
            show.say(console, f"note: {note}")


def tell_comparison(console: Console, compared: Comparison) -> None:
    """Show both methods' values side by side, and why any is missing; disagreements are among the first's doubts."""
    methods = (compared.first.method, compared.second.method)
    rows = [
        (
            d.name,
            *(
                show.number(estimate.value) if estimate.identifiable else "-"
                for estimate in (d.first, d.second)
            ),
            d.first.unit,
            show.number(d.distance, 2),
            "disagree" if d.disagrees else "",
        )
        for d in compared.differences
        if d.first.identifiable or d.second.identifiable
    ]
    if rows:
        title = f"{methods[0]} beside {methods[1]} ({compared.second.outcome.value})"
        columns = ("name", *methods, "unit", "apart, std", "beyond intervals")
        show.put(console, show.Table(title, columns, rows, (*methods, "apart, std")))
    if not compared.disagreements:
        show.say(console, *(f"note: {sentence}" for sentence in compared.sentences))
    show.say(console, *(f"note: {sentence}" for sentence in further_remarks(compared)))


def _row(parameter: Estimate, reasons: Sequence[str], priors: bool) -> tuple[str, ...]:
    """Value, interval with the thrust's uncertainty, and the standard error given the thrust."""
    values = (parameter.value, *parameter.with_thrust)
    partner = parameter.partner if parameter.partner and parameter.partner.is_close else None
    return (
        parameter.name,
        *(show.number(value) for value in values),
        parameter.unit,
        show.number(100 * parameter.wider_std, 2),
        f"{partner.name} {partner.correlation:+.2f}" if partner else "-",
        *(
            (f"{100 * parameter.share_from_prior:.0f}" if parameter.share_from_prior else "-",)
            if priors
            else ()
        ),
        "yes" if parameter.identifiable else f"no, see {1 + reasons.index(parameter.reason)}",
    )
