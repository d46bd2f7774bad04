"""Page that compares a real dive with a simulator: changes to make in the simulator, then the diagnosis of the gap."""

from dataclasses import replace

from identify.diagnose import wording, wording_verdict
from identify.diagnose.against import Against, Difference, lines, verdict_sentence
from identify.report.diagnosis import sections, subtitle, unbroken
from identify.report.page import Report, Section, Table
from identify.words import MISSING, unit, with_interval

HOW = (
    "Both recordings are diagnosed alike, each by its own commands. The gap is that of the simulator's own model, "
    "masses, dampings and effects, along the real dive: before is the simulator as it is, after the simulator with all "
    "that is named here. A number of the simulator that its own recording does not tell is taken as near to the "
    "vehicle's as that recording allows."
)


def against_report(one: Against) -> Report:
    """Build the page: verdict and parts."""
    return Report(
        f"{one.vehicle.vehicle}: {one.vehicle.dive} against the simulator's {one.simulator.dive}",
        subtitle(one.vehicle),
        unbroken(verdict_sentence(one)),
        (_change(one), *sections(replace(one.vehicle, verdict=one.verdict)), _own(one)),
    )


def _change(one: Against) -> Section:
    """Changes to make in the simulator."""
    rows = [*_gained(one), *(_row(difference) for difference in one.off)]
    columns = ("What", "Simulator has", "Vehicle has", "95 % interval", "Unit", "Off by")
    table = (
        (Table(columns, tuple(rows), "What to set in the simulator, all of it together."),) if rows else ()
    )
    possible = tuple(each for each in one.differences if each not in one.off)
    text = [HOW, *lines(replace(one, differences=possible))]
    return Section("What to change in the simulator", "\n\n".join(text), table)


def _gained(one: Against) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for lacking in wording_verdict.sorted_by_likelihood(one.lacks)[0]:
        cause = wording.effect_words(lacking.cause.effect)
        values = wording.told_parameters(lacking)
        for name, value in values.items():
            number, interval = with_interval(value.value, value.low95, value.high95)
            unit_text = unit(value.unit) if value.unit != "1" else MISSING
            rows.append((f"{cause}, {wording.parameter(name)}", "none", number, interval, unit_text, MISSING))
        if not values:
            rows.append((cause, "none", MISSING, MISSING, MISSING, MISSING))
    return rows


def _row(one: Difference) -> tuple[str, ...]:
    name = f"{wording.words(one.of)}, {wording.parameter(one.name)}" if one.of else one.name
    its, _ = with_interval(one.simulator.value, one.simulator.low95, one.simulator.high95)
    number, interval = with_interval(one.vehicle.value, one.vehicle.low95, one.vehicle.high95)
    unit_text = unit(one.vehicle.unit) if one.vehicle.unit != "1" else MISSING
    return (
        name,
        its,
        number,
        interval,
        unit_text,
        f"{'+' if one.share > 0 else '−'}{wording.percent(abs(one.share))}",
    )


def _own(one: Against) -> Section:
    """Diagnosis of the simulator's own recording."""
    return Section(
        "What the simulator has",
        "\n\n".join((wording_verdict.verdict_sentence(one.simulator), *wording.cause_lines(one.simulator))),
    )
