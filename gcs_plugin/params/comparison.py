"""The values of a file compared with a vehicle: what it asks for, and the plan of its upload or roll back.

The command, the app and MAVProxy show the same lines and notes.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from bridge.errors import ParamRejected, ParamUnknown
from bridge.vehicle.effect_coefficients import EffectCoefficient
from bridge.vehicle.parameters import ACTIVE, MODE
from gcs_plugin.params.files import Interval, Sidecar, read_parameters, read_sidecar, sidecar_path, system_of
from gcs_plugin.params.last_accepted import (
    AcceptedValue,
    belongs,
    keep_accepted,
    last_accepted,
    reminder,
    unfinished,
)
from gcs_plugin.params.plan import (
    Plan,
    Row,
    Verdict,
    coefficient_of,
    make_plan,
    not_raised,
    obstacle,
    staged_crc,
    staging_notes,
    taken_back,
    unit_of,
    value_text,
)
from gcs_plugin.params.plausible import implausible
from gcs_plugin.params.receipt import Newest, Receipt, new_preimage
from gcs_plugin.params.session import Order
from gcs_plugin.params.transfer import Source
from gcs_plugin.params.upload import Upload

CONVERGED: Final = "converged"
TAKEN_BACK: Final = "no part of this model, taken back"


@dataclass(frozen=True)
class Wanted:
    """Values to be sent, by parameter id, with their origin.

    `notes` are sentences about the origin; `whole`: the values are a complete model, so effects accepted earlier no
    longer hold; `sidecar` has intervals and origin, if the file has one; `system` is the only MAVLink system that may
    have the values, None for any; `left_out` are the lines of the file that were not chosen. If a vehicle file was
    given, `rigid` is mass or inertia of the rigid body and its standard deviation, by the id of the total, and `kept`
    the least and the greatest value that such a vehicle takes, by id.
    """

    values: dict[str, float]
    notes: tuple[str, ...] = ()
    whole: bool = False
    sidecar: Sidecar | None = None
    system: int | None = None
    left_out: frozenset[str] = frozenset()
    rigid: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    kept: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def intervals(self) -> Mapping[str, Interval]:
        return {} if self.sidecar is None else self.sidecar.intervals

    @property
    def doubted(self) -> Mapping[str, str]:
        """Reasons to doubt a value, by coefficient."""
        return {} if self.sidecar is None else self.sidecar.doubted

    @property
    def warnings(self) -> tuple[str, ...]:
        """A line for each value that is doubted."""
        taken = {known.name for name in self.values if (known := coefficient_of(name)) is not None}
        return tuple(
            f"warning: {name} is doubted: {why}" for name, why in self.doubted.items() if name in taken
        )

    def narrowed(self, file: Path, only: Collection[str] | None) -> "Wanted":
        """The named lines alone. Raises ParamUnknown for a name that the file lacks.

        Effects that the vehicle holds and a whole model takes back may be named too: only the vehicle knows these.
        """
        missing = [
            name
            for name in only or ()
            if name not in self.values
            and not (self.whole and isinstance(coefficient_of(name), EffectCoefficient))
        ]
        if missing:
            raise ParamUnknown(
                f"{file}: has no {', '.join(missing)}; it has {', '.join(sorted(self.values))}"
            )
        chosen = {name: value for name, value in self.values.items() if only is None or name in only}
        return replace(self, values=chosen, left_out=frozenset(self.values) - frozenset(chosen))


def wanted_by(path: Path, option: str, *, despite_doubts: bool, any_vehicle: bool = False) -> Wanted:
    """Read a parameter file and its sidecar.

    Raises ParamRejected for a damaged file, and for an identification that did not converge unless `despite_doubts`;
    `option` is what the user adds to send it all the same. With `any_vehicle`, any system may have the values.
    """
    if path.suffix == ".json":
        raise ParamRejected(
            f"{path}: is no parameter file; give the .param that `seatrial identify --param` wrote"
        )
    values, sidecar = read_parameters(path), read_sidecar(path)
    system = None if any_vehicle else system_of(path)
    if sidecar is None:
        return Wanted(values, system=system)
    outcome = sidecar.outcome or CONVERGED
    if outcome != CONVERGED and not despite_doubts:
        raise ParamRejected(
            f"{path}: the identification ended with '{outcome}', so its values may be wrong: nothing was sent; "
            f"dive again, or give {option}"
        )
    origin = (
        f"from {sidecar.dive or 'a dive'} of {sidecar.vehicle or 'a vehicle'}, configuration "
        f"{sidecar.configuration}, by {sidecar.method}: {sidecar.outcome or 'outcome unknown'}"
    )
    return Wanted(values, (origin,), True, sidecar, system)


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

    def to_json(self, doubted: Mapping[str, str]) -> dict[str, Any]:
        """The line as `params diff --json` writes it; SI units, null for unknown values.

        `doubted` gives reasons to doubt a value, by coefficient.
        """
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
            "doubted": doubted.get(coefficient.name, "") if coefficient else "",
        }


def compared(
    plan: Plan, intervals: Mapping[str, Interval], accepted: Mapping[str, AcceptedValue]
) -> tuple[Compared, ...]:
    """The lines of a plan, each with its interval and its last accepted value."""
    return tuple(Compared(row, intervals.get(row.name), accepted.get(row.name)) for row in plan.rows)


@dataclass(frozen=True)
class Planned:
    """A plan, line by line compared with the values last accepted.

    `back` are the effects that it takes back, `left` sentences about the vehicle's staged set and an unfinished
    upload; `restores` is the file that a roll back goes back to, "" for an upload.
    """

    file: Path
    wanted: Wanted
    plan: Plan
    lines: tuple[Compared, ...]
    back: tuple[str, ...] = ()
    left: tuple[str, ...] = ()
    restores: str = ""

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences about the plan, in addition to its lines."""
        unchecked: tuple[str, ...] = ()
        back: tuple[str, ...] = ()
        if self.wanted.sidecar is None and not self.restores:
            missing = f"{sidecar_path(self.file).name} is not beside it"
            unchecked = (
                f"note: vehicle file and intervals of {self.file.name} could not be checked: {missing}",
            )
        if self.back:
            names = ", ".join(self.back)
            back = (f"note: effects accepted before are no part of this model and are taken back: {names}",)
        return (*self.left, *unchecked, *self.wanted.notes, *self.wanted.warnings, *back)

    @property
    def whole(self) -> bool:
        """Whether it is a complete model with all of its lines."""
        return self.wanted.whole and not self.wanted.left_out

    def cells(self, hidden: Collection[Verdict]) -> list[tuple[str, ...]]:
        """Texts of its lines, in the order of COLUMNS, without those of the `hidden` verdicts."""
        return [line.cells() for line in self.lines if line.row.verdict not in hidden]

    def order(self, receipts: Path, unix_s: float, *, even_armed: bool, read_at: Newest) -> Order:
        """The order to carry it out, at that time, with its receipt in the folder `receipts`."""
        sidecar = self.wanted.sidecar if self.whole and not self.restores else None
        preimage = new_preimage(receipts, unix_s)
        return Order(self.plan, preimage, even_armed, self.restores, sidecar, read_at)

    def keep(self, receipt: Receipt) -> Path | None:
        """Write down the values that the vehicle accepted, see `keep_accepted`."""
        return keep_accepted(receipt, self.wanted.sidecar, self.whole)

    def rehearsed(self, vehicle: Source) -> Upload:
        """The upload as it would begin now: says whether it writes anything or needs a disarmed vehicle."""
        return Upload(self.plan.with_implausible(), vehicle)

    def writes(self, vehicle: Source) -> bool:
        """Whether an upload would write something, if only a commit."""
        return self.rehearsed(vehicle).ending is None

    def to_json(self, vehicle: Source, *, armed: bool) -> dict[str, Any]:
        """The form that `params diff --json` writes. `writes`: an upload would write something, if only a commit.

        `active_crc` and `staged_crc` are those of the set in use, 0 for none, and of the set that the vehicle holds:
        if they differ, the set held is not in use. Null for a vehicle that takes no sets.
        """
        rehearsed, sidecar = self.rehearsed(vehicle), self.wanted.sidecar
        return {
            "summary": self.plan.summary(),
            "file": str(self.file),
            "outcome": sidecar.outcome if sidecar else "",
            "of": sidecar.dive if sidecar else "",
            "vehicle": {"system": vehicle[0], "component": vehicle[1], "armed": armed},
            "ff_mode": self.plan.present.get(MODE),
            "writes": rehearsed.ending is None,
            "active_crc": self.plan.present.get(ACTIVE),
            "staged_crc": staged_crc(self.plan.present),
            "needs_disarmed": rehearsed.needs_disarmed,
            "obstacle_armed": obstacle(self.plan.present),
            "notes": list(self.notes),
            "parameters": [line.to_json(self.wanted.doubted) for line in self.lines],
        }


def planned(
    file: Path,
    wanted: Wanted,
    present: Mapping[str, float],
    only: Collection[str] | None,
    receipts: Path,
    system: int,
    accepts: Collection[str] = (),
) -> Planned:
    """Plan to bring a vehicle that holds `present` to the values of a file, or to those of its lines in `only`.

    `accepts` are lines that are written although they are implausible. Raises ParamUnknown for a line in `only` that
    needs no change.
    """
    model = dict.fromkeys((*wanted.values, *wanted.left_out), 0.0)
    back = taken_back(model, present) if wanted.whole else {}
    back = {name: value for name, value in back.items() if only is None or name in only}
    plan = make_plan(wanted.values | back, present).explained(back, TAKEN_BACK)
    missing = set(only or ()) - {row.name for row in plan.rows}
    if missing:
        raise ParamUnknown(f"{file}: nothing of {', '.join(sorted(missing))} is to be changed; leave it out")
    accepted = last_accepted(receipts, system)
    doubted = implausible(plan, wanted.intervals, accepted, wanted.rigid, wanted.kept)
    plan = plan.judged({name: why for name, why in doubted.items() if name not in accepts})
    lines = compared(plan, wanted.intervals, accepted)
    return Planned(file, wanted, plan, lines, tuple(back), _left(file, present, receipts, system))


def planned_back(
    file: Path, wanted: Wanted, present: Mapping[str, float], receipts: Path, system: int
) -> Planned:
    """Plan to go back to the values before an upload."""
    plan = make_plan(not_raised(wanted.values, present), present)
    lines = compared(plan, wanted.intervals, last_accepted(receipts, system))
    left = _left(file, present, receipts, system)
    return Planned(file, wanted, plan, lines, left=left, restores=str(file))


def left_behind(receipts: Path, system: int, present: Mapping[str, float]) -> tuple[str, ...]:
    """Sentences about the vehicle's staged set and an upload to it that was never finished."""
    return _left(None, present, receipts, system)


def _left(file: Path | None, present: Mapping[str, float], receipts: Path, system: int) -> tuple[str, ...]:
    left = unfinished(receipts, system)
    mute = left is None or (file is not None and belongs(left, file))
    return (*staging_notes(present), *(() if mute or left is None else reminder(left, present)))
