"""The receipt of an upload: what was asked, what was there before, what is there now, and how it is known."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gcs_plugin.params.plan import Plan
from gcs_plugin.params.transfer import Outcome, Result


@dataclass(frozen=True, slots=True)
class Line:
    """One parameter: `after` is the last independent read-back, None where none came."""

    name: str
    before: float | None
    target: float
    after: float | None
    outcome: Outcome
    sentence: str


@dataclass(frozen=True)
class Receipt:
    """What became of an upload. `active_crc` is the staged set that was to fly, None without a commit; `restores` the
    -before.param that was gone back to, "" for an upload of anything else."""

    outcome: Outcome
    sentence: str
    system: int
    component: int
    lines: tuple[Line, ...]
    preimage: Path
    active_crc: int | None
    started_utc: str
    took_s: float
    restores: str = ""

    @property
    def good(self) -> bool:
        """Whether the vehicle holds what was asked."""
        return self.outcome in (Outcome.APPLIED, Outcome.SAME)

    def to_json(self) -> dict[str, Any]:
        """The form that `--json` writes; numbers that do not exist become null."""
        return {
            "outcome": self.outcome.name.lower(),
            "sentence": self.sentence,
            "vehicle": {"system": self.system, "component": self.component},
            "parameters": [
                {
                    "name": line.name,
                    "before": _number(line.before),
                    "target": _number(line.target),
                    "after": _number(line.after),
                    "outcome": line.outcome.name.lower(),
                    "sentence": line.sentence,
                }
                for line in self.lines
            ],
            "preimage": str(self.preimage),
            "active_crc": self.active_crc,
            "started_utc": self.started_utc,
            "took_s": round(self.took_s, 3),
            "restores": self.restores,
        }


def lines_of(plan: Plan, results: Mapping[str, Result]) -> tuple[Line, ...]:
    """The lines of a receipt in the plan's order."""
    return tuple(
        Line(
            row.name,
            row.present,
            row.target,
            results[row.name].seen,
            results[row.name].outcome,
            results[row.name].sentence,
        )
        for row in plan.rows
    )


def _number(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
