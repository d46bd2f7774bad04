"""Page of `seatrial identify`: the answer to each dive, its comparison with a second method, and the dive itself."""

from collections.abc import Mapping, Sequence
from typing import Protocol

from bridge.vehicle.coefficients import OF_HULL
from identify.dive import Array
from identify.identification import Identification
from identify.report.page import Report
from identify.report.sections import (
    comparison_section,
    dive_section,
    identification_section,
    innovations_section,
    training_section,
)
from identify.run.identify import Identified


class Trained(Protocol):
    """Training curves of a network: the values (passes, parameters) of the parameters in `names`."""

    @property
    def names(self) -> Sequence[str]: ...

    @property
    def values(self) -> Array: ...


def _in_model(answer: Identification) -> int:
    """Number of coefficients in the model of an answer."""
    return sum(parameter.name in OF_HULL for parameter in answer.parameters)


def identification_report(answers: Sequence[Identified], curves: Mapping[str, Trained]) -> Report:
    """Return the page with the results of each dive and the dives themselves."""
    sections = []
    for each in answers:
        sections.append(identification_section(each.answer))
        for comparison in each.comparisons:
            sections += [comparison_section(comparison), identification_section(comparison.second)]
        if each.dive.sha256 in curves:
            trained = curves[each.dive.sha256]
            values = {name: trained.values[:, i] for i, name in enumerate(trained.names)}
            sections.append(training_section(values))
        if each.answer.innovations:
            sections.append(innovations_section(each.answer.innovations, each.dive.name))
        sections.append(dive_section(each.dive, each.file.vehicle.water))
    methods = [answers[0].answer.method, *(comparison.second.method for comparison in answers[0].comparisons)]
    verdict = "; ".join(
        f"{each.dive.name} ({each.answer.configuration}): {len(each.answer.values())} of {_in_model(each.answer)} "
        f"coefficients identified, {each.answer.outcome.value}"
        for each in answers
    )
    file = answers[-1].file
    return Report(
        f"{file.vehicle.name}: {', '.join(each.dive.name for each in answers)}",
        f"vehicle file {file.path.name}, method {' beside '.join(methods)}",
        f"{verdict}.",
        tuple(sections),
    )
