"""Table of a plan: each line's change, relative to its 95 % interval, and the value last accepted."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from gcs_plugin.params.last_accepted import AcceptedValue
from gcs_plugin.params.plan import Plan, Row, coefficient_of, unit_of, value_text
from gcs_plugin.params.sidecar import Interval

COLUMNS = ("name", "unit", "on the vehicle", "in the file", "last accepted", "change", "verdict")
NUMBERS = COLUMNS[2:6]
LEGEND = "change: in halves of the 95 % interval that the file gives; below 1 it is within it"


@dataclass(frozen=True, slots=True)
class Compared:
    """Line of a plan, with the 95 % interval of its target and the value last accepted; None if not known."""

    row: Row
    interval: Interval | None
    accepted: AcceptedValue | None

    @property
    def change(self) -> float | None:
        """Target minus present value, divided by half the target's 95 % interval; None if either is not known."""
        half = 0.0 if self.interval is None else (self.interval.high95 - self.interval.low95) / 2
        if self.row.present is None or half <= 0.0:
            return None
        return (self.row.target - self.row.present) / half

    def cells(self) -> tuple[str, ...]:
        """Texts of the table's cells, in the order of COLUMNS."""
        row, change = self.row, self.change
        return (
            row.name,
            unit_of(row.name),
            "-" if row.present is None else value_text(row.present),
            value_text(row.target),
            "-" if self.accepted is None else value_text(self.accepted.value),
            "-" if change is None else f"{change:+.1f}",
            f"{row.verdict.value}: {row.reason}" if row.reason else row.verdict.value,
        )

    def to_json(self) -> dict[str, Any]:
        """The line as `params diff --json` writes it; SI units, null for unknown values."""
        coefficient = coefficient_of(self.row.name)
        return {
            "name": self.row.name,
            "coefficient": coefficient.name if coefficient else "",
            "sentence": coefficient.sentence if coefficient else "",
            "unit": unit_of(self.row.name),
            "present": self.row.present,
            "target": self.row.target,
            "low95": None if self.interval is None else self.interval.low95,
            "high95": None if self.interval is None else self.interval.high95,
            "accepted": None if self.accepted is None else self.accepted.value,
            "accepted_at": None if self.accepted is None else self.accepted.time,
            "change": self.change,
            "verdict": self.row.verdict.value,
            "reason": self.row.reason,
        }


def compared(
    plan: Plan, intervals: Mapping[str, Interval], accepted: Mapping[str, AcceptedValue]
) -> tuple[Compared, ...]:
    """The lines of a plan, each with its interval and its last accepted value."""
    return tuple(Compared(row, intervals.get(row.name), accepted.get(row.name)) for row in plan.rows)
