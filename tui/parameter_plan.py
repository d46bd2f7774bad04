"""The plan of `params` for a vehicle, compared with the values last accepted, as a table and as JSON."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from bridge.errors import ParamRejected
from bridge.parameters import ACTIVE, MODE, set_crc
from gcs_plugin.params.client import ParameterClient, not_raised, obstacle
from gcs_plugin.params.deadline import Timing
from gcs_plugin.params.files import check_system
from gcs_plugin.params.last_accepted import (
    COLUMNS,
    LEGEND,
    NUMBERS,
    Compared,
    before_newest,
    belongs,
    compared,
    last_accepted,
    told,
    unfinished,
)
from gcs_plugin.params.plan import Plan, Verdict, make_plan, staged_crc, staging_notes, taken_back
from gcs_plugin.params.plausible import implausible
from gcs_plugin.params.sidecar import unchecked
from gcs_plugin.params.transfer import Source
from gcs_plugin.params.upload import Upload
from tui import show
from tui.exit_codes import NothingLeft, UsageError
from tui.parameter_files import Targets

TAKEN_BACK = "no part of this model, taken back"


@dataclass(frozen=True)
class Planned:
    """A plan, line by line compared with the values last accepted.

    `back` are the effects that it takes back, `left` sentences about the vehicle's staged set and an unfinished
    upload.
    """

    file: Path
    targets: Targets
    plan: Plan
    lines: tuple[Compared, ...]
    back: tuple[str, ...]
    left: tuple[str, ...] = ()

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences about the plan, in addition to its lines."""
        notes = (*self.left, *self.targets.notes)
        if not self.back:
            return notes
        back = "note: effects accepted before are no part of this model and are taken back"
        return (*notes, f"{back}: {', '.join(self.back)}")

    @property
    def whole(self) -> bool:
        """Whether it is a complete model with all of its lines."""
        return self.targets.whole and not self.targets.left_out

    def table(self, hidden: Collection[Verdict]) -> show.Table | None:
        """Its lines, without those of the `hidden` verdicts; None if none are left."""
        cells = [line.cells() for line in self.lines if line.row.verdict not in hidden]
        return show.table("", COLUMNS, cells, numbers=NUMBERS) if cells else None

    def tell(self, json_target: str | None, hidden: Collection[Verdict]) -> None:
        """Print table and summary."""
        console = show.results(json_target)
        table = self.table(hidden)
        if table is not None:
            show.put(console, table)
        if any(line.change is not None for line in self.lines):
            show.say(console, LEGEND)
        show.say(console, self.plan.summary())

    def to_json(self, client: ParameterClient) -> dict[str, Any]:
        """The form that `params diff --json` writes. `writes`: an upload would write something, if only a commit.

        `active_crc` and `staged_crc` are those of the set in use, 0 for none, and of the set that the vehicle holds:
        if they differ, the set held is not in use. Null for a vehicle that takes no sets.
        """
        system, component = client.vehicle
        rehearsed = self._rehearsed(client.vehicle)
        return {
            "summary": self.plan.summary(),
            "file": str(self.file),
            "outcome": self.targets.sidecar.outcome if self.targets.sidecar else "",
            "of": self.targets.sidecar.dive if self.targets.sidecar else "",
            "vehicle": {"system": system, "component": component, "armed": client.armed},
            "ff_mode": self.plan.present.get(MODE),
            "writes": rehearsed.ending is None,
            "active_crc": self.plan.present.get(ACTIVE),
            "staged_crc": staged_crc(self.plan.present),
            "needs_disarmed": rehearsed.needs_disarmed,
            "obstacle_armed": obstacle(self.plan.present),
            "notes": list(self.notes),
            "parameters": [self._line(line) for line in self.lines],
        }

    def writes(self, vehicle: Source) -> bool:
        """Whether an upload would write something, if only a commit."""
        return self._rehearsed(vehicle).ending is None

    def _rehearsed(self, vehicle: Source) -> Upload:
        return Upload(self.plan.with_implausible(), vehicle, 0.0, Timing(), set_crc)

    def _line(self, line: Compared) -> dict[str, Any]:
        doubted = self.targets.sidecar.doubted if self.targets.sidecar else {}
        data = line.to_json()
        return {**data, "doubted": doubted.get(data["coefficient"], "")}


def planned(
    file: Path,
    targets: Targets,
    present: Mapping[str, float],
    only: Collection[str] | None,
    receipts: Path,
    system: int,
    accepts: Collection[str] = (),
) -> Planned:
    """Plan to bring a vehicle that holds `present` to the values of a file, or to those of its lines in `only`.

    `accepts` are lines that are written although they are implausible. Raises UsageError for a line in `only` that
    needs no change, and for a file of another vehicle.
    """
    _check_system(file, targets, system)
    targets = replace(targets, notes=(*unchecked(file, targets.sidecar), *targets.notes))
    model = dict.fromkeys((*targets.values, *targets.left_out), 0.0)
    back = taken_back(model, present) if targets.whole else {}
    back = {name: value for name, value in back.items() if only is None or name in only}
    plan = make_plan(targets.values | back, present).explained(back, TAKEN_BACK)
    intervals = targets.sidecar.intervals if targets.sidecar else {}
    doubted = implausible(plan, intervals, last_accepted(receipts, system), targets.rigid, targets.kept)
    plan = plan.judged({name: why for name, why in doubted.items() if name not in accepts})
    return _beside(file, targets, plan, tuple(back), only, receipts, system)


def planned_back(
    file: Path, targets: Targets, present: Mapping[str, float], receipts: Path, system: int
) -> Planned:
    """Plan to go back to the values before an upload. Raises UsageError for values of another vehicle."""
    _check_system(file, targets, system)
    plan = make_plan(not_raised(targets.values, present), present)
    return _beside(file, targets, plan, (), None, receipts, system)


def newest(receipts: Path, system: int) -> Path:
    """File with the values before the last upload that still stands. Raises NothingLeft if there was none."""
    try:
        return before_newest(receipts, system)
    except ParamRejected as error:
        raise NothingLeft(str(error)) from None


def _check_system(file: Path, targets: Targets, system: int) -> None:
    try:
        check_system(file, targets.system, system, ", or --any-vehicle")
    except ParamRejected as error:
        raise UsageError(str(error)) from None


def _beside(
    file: Path,
    targets: Targets,
    plan: Plan,
    back: Sequence[str],
    only: Collection[str] | None,
    receipts: Path,
    system: int,
) -> Planned:
    missing = set(only or ()) - {row.name for row in plan.rows}
    if missing:
        raise UsageError(f"{file}: nothing of {', '.join(sorted(missing))} is to be changed; leave it out")
    intervals = targets.sidecar.intervals if targets.sidecar else {}
    lines = compared(plan, intervals, last_accepted(receipts, system))
    left = unfinished(receipts, system)
    notes = () if left is None or belongs(left, file) else told(left, plan.present)
    notes = (*staging_notes(plan.present), *notes)
    return Planned(file, targets, plan, lines, tuple(back), notes)


def left_behind(receipts: Path, system: int, present: Mapping[str, float]) -> tuple[str, ...]:
    """Sentences about an upload to that vehicle that was never finished; empty if there is none."""
    left = unfinished(receipts, system)
    return () if left is None else told(left, present)
