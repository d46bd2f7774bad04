"""Table of a batch: a row per dive, by date, with its identified values and the doubts about them; written as CSV and
JSON.
"""

import csv
import io
import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Any

from bridge.clock import date_in_name, utc_text
from bridge.vehicle.coefficients import ADDED_MASS_NAMES, COEFFICIENTS, MASSES
from identify.batch.dive_causes import DiveCauses
from identify.batch.jobs import Result
from identify.doubt import Culprit, Doubt, Outcome
from identify.run.recordings import TOTAL_MASSES

_TOTAL = dict(zip(ADDED_MASS_NAMES, (mass.name for mass in MASSES), strict=True))


def doubts_in(identification: Mapping[str, Any]) -> tuple[Doubt, ...]:
    """Doubts in an identification's JSON that concern its values; doubts of a prior are left out."""
    every = (
        Doubt(
            tuple(doubt["about"]),
            doubt["problem"],
            doubt["remedy"],
            Outcome(doubt["outcome"]),
            Culprit(doubt["culprit"]),
            tuple(doubt["also"]),
        )
        for doubt in identification["doubts"]
    )
    return tuple(doubt for doubt in every if doubt.culprit is not Culprit.PRIOR)


def is_about(doubt: Doubt, name: str) -> bool:
    """Whether a doubt is about a parameter. A doubt about a total mass is also about the added mass in it."""
    return name in doubt.about or _TOTAL.get(name) in doubt.about


def clauses(doubts: Collection[Doubt], names: Collection[str]) -> dict[str, str]:
    """For each doubted parameter of `names`, the problem of every doubt about it, joined by semicolons."""
    clauses_of = {
        name: tuple(dict.fromkeys(doubt.clause for doubt in doubts if is_about(doubt, name)))
        for name in names
    }
    return {name: "; ".join(some) for name, some in clauses_of.items() if some}


NAMES = (*(coefficient.name for coefficient in COEFFICIENTS), *ADDED_MASS_NAMES)


AT_THRUST = ("value", "given_thrust_std", "given_thrust_low95", "given_thrust_high95")
"""Keys of an identification's JSON that hold given the vehicle file's thrust, which is the same in all dives."""


@dataclass(frozen=True)
class Value:
    """An identified parameter with its standard error and 95 % interval given the vehicle file's thrust, in the
    parameter's unit."""

    value: float
    std: float
    low95: float
    high95: float


@dataclass(frozen=True)
class Row:
    """A dive. `values` holds the identified parameters by name, total masses without the load that this dive carried
    on top of the vehicle file's; `error` says why there are none.

    `unix_s` is when the dive began, `dated_by` the source of that date; None if the date is unknown. `correlation`
    holds the correlation of two parameters' errors by the pair of their names; a missing pair counts as 0. `doubts`
    are the doubts about its values. `causes`: its diagnosis, None if none was asked for.
    """

    dive: str
    source: str
    sha256: str
    configuration: str = ""
    outcome: str = ""
    unix_s: float | None = None
    dated_by: str = ""
    duration_s: float | None = None
    voltage_v: float | None = None
    values: Mapping[str, Value] = field(default_factory=dict)
    correlation: Mapping[frozenset[str], float] = field(default_factory=dict)
    error: str = ""
    doubts: tuple[Doubt, ...] = ()
    causes: DiveCauses | None = None

    @property
    def doubted(self) -> dict[str, str]:
        """Objections to each doubted value, by parameter name."""
        return clauses(self.doubts, tuple(self.values))

    @property
    def converged(self) -> bool:
        """Whether its values can be relied on as they are."""
        return self.outcome == Outcome.CONVERGED.value


def rows_of(results: Sequence[Result], diagnoses: Sequence[Result] = ()) -> list[Row]:
    """Rows sorted by date; dives without a date come last, by name. `diagnoses`: of the same recordings."""
    causes = {
        each.sha256: DiveCauses(error=each.error)
        if each.answer is None
        else DiveCauses.from_json(each.answer)
        for each in diagnoses
    }
    rows = [_row(result, causes.get(result.sha256)) for result in results]
    return sorted(rows, key=lambda row: (row.unix_s is None, row.unix_s or 0.0, row.dive, row.source))


def diagnosed(rows: Sequence[Row]) -> dict[str, list[Row]]:
    """Rows with a diagnosis that gave a verdict, grouped by the vehicle's configuration."""
    return _grouped((row.causes.configuration, row) for row in rows if row.causes and not row.causes.error)


def by_configuration(rows: Sequence[Row]) -> dict[str, list[Row]]:
    """Rows that hold values, grouped by the vehicle's configuration."""
    return _grouped((row.configuration, row) for row in rows if row.values)


def _grouped(rows: Iterable[tuple[str, Row]]) -> dict[str, list[Row]]:
    groups: dict[str, list[Row]] = {}
    for name, row in rows:
        groups.setdefault(name, []).append(row)
    return dict(sorted(groups.items()))


def names_in(rows: Sequence[Row]) -> list[str]:
    """Coefficients that any row has, in the order of COEFFICIENTS; not added masses, which follow from the others."""
    return [c.name for c in COEFFICIENTS if any(c.name in row.values for row in rows)]


def to_csv(rows: Sequence[Row]) -> str:
    """One line per dive: value, standard error and 95 % interval of each parameter, empty if not identified.

    `doubted` lists the doubted parameters, separated by spaces. `verdict` and `causes` are empty without a diagnosis.
    """
    columns = [f"{name}{part}" for name in NAMES for part in ("", "_std", "_low95", "_high95")]
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(("dive", "date_utc", "configuration", "outcome", "doubted", "error", "duration_s", "voltage_v",
                     "verdict", "causes", *columns, "source", "sha256"))  # fmt: skip
    for row in rows:
        values, of = [row.values.get(name) for name in NAMES], row.causes or DiveCauses()
        causes = "; ".join(f"{item.words}: {item.size_words}" for item in of.found)
        numbers = [n for v in values for n in ((v.value, v.std, v.low95, v.high95) if v else ("",) * 4)]
        writer.writerow((row.dive, iso(row.unix_s), row.configuration, row.outcome, " ".join(row.doubted),
                         row.error, row.duration_s, row.voltage_v, of.verdict, causes, *numbers,
                         row.source, row.sha256))  # fmt: skip
    return out.getvalue()


def to_json(row: Row) -> dict[str, Any]:
    return {
        **{
            name: value
            for name, value in vars(row).items()
            if name not in ("values", "correlation", "unix_s", "doubts", "causes")
        },
        "diagnosis": None if row.causes is None else row.causes.to_json(),
        "doubted": row.doubted,
        "date_utc": iso(row.unix_s) or None,
        "parameters": {name: vars(value) for name, value in row.values.items()},
    }


def iso(unix_s: float | None) -> str:
    """Text such as `2026-11-20T09:12:03Z`; empty for no date."""
    return "" if unix_s is None else utc_text(unix_s)


def _row(result: Result, causes: DiveCauses | None) -> Row:
    """The row of a dive, dated by its diagnosis if nothing else dates it."""
    row = _identified(result)
    dated_s = causes.unix_s if causes is not None and row.unix_s is None else row.unix_s
    return replace(row, causes=causes, unix_s=dated_s)


def _identified(result: Result) -> Row:
    if result.answer is None:
        named_s = date_in_name(result.dive)
        dated_by = "" if named_s is None else "its name"
        return Row(
            result.dive, result.source, result.sha256, unix_s=named_s, dated_by=dated_by, error=result.error
        )
    identification = result.answer["identification"]
    values = {
        p["name"]: _without(Value(*(p[key] for key in AT_THRUST)), p["name"], result.answer["carried_kg"])
        for p in identification["parameters"]
        if p["identifiable"] and p["name"] in NAMES and None not in [p[key] for key in AT_THRUST]
    }
    return Row(
        result.dive,
        result.source,
        result.sha256,
        identification["configuration"],
        identification["outcome"],
        result.answer["unix_s"],
        result.answer["dated_by"],
        identification["dive"]["duration_s"],
        result.answer["voltage_v"],
        values,
        _correlation(list(values), identification["covariance"]),
        "" if values else _why_nothing(identification),
        doubts_in(identification),
    )


def _without(value: Value, name: str, carried_kg: float) -> Value:
    """A value of the vehicle as its file has it: a total mass less that dive's load."""
    if name not in TOTAL_MASSES or not carried_kg:
        return value
    low95, high95 = value.low95 - carried_kg, value.high95 - carried_kg
    return Value(value.value - carried_kg, value.std, low95, high95)


def _correlation(names: Sequence[str], covariance: Mapping[str, Any]) -> dict[frozenset[str], float]:
    """Correlation of each pair. If the covariance lacks the pair, 1: then a mean gains nothing from more values."""
    place = {name: i for i, name in enumerate(covariance["of"])}
    matrix = covariance["matrix"]
    correlations = {}
    for a, b in combinations(names, 2):
        entries = (
            [matrix[place[p]][place[q]] for p, q in ((a, b), (a, a), (b, b))]
            if {a, b} <= place.keys()
            else []
        )
        known = bool(entries) and None not in entries and min(entries[1:]) > 0
        value = entries[0] / math.sqrt(entries[1] * entries[2]) if known else 1.0
        correlations[frozenset((a, b))] = max(-1.0, min(1.0, value))
    return correlations


def _why_nothing(answer: Mapping[str, Any]) -> str:
    reasons = dict.fromkeys(p.get("reason") or answer["outcome"] for p in answer["parameters"])
    return "; ".join(reasons)
