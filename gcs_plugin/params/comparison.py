"""The values of a file compared with a vehicle, and the plan of their upload or roll back.

The command, the app and MAVProxy show the same lines and notes.
"""

from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from bridge import schema
from bridge.errors import ParamError, ParamRejected, ParamUnknown
from bridge.vehicle.coefficients import EffectCoefficient
from bridge.vehicle.parameters import ACTIVE, MODE
from gcs_plugin.params.files import read_parameters, system_of
from gcs_plugin.params.identified import doubt_lines
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
    acting,
    acting_text,
    coefficient_of,
    is_unset,
    make_plan,
    not_raised,
    obstacle,
    staged_crc,
    staging_notes,
    taken_back,
    unit_of,
)
from gcs_plugin.params.plausible import half_a_model, implausible, other_half
from gcs_plugin.params.receipt import RECEIPT, Newest, Receipt, new_preimage, path_of
from gcs_plugin.params.session import Order
from gcs_plugin.params.sidecar import Interval, Sidecar, read_sidecar, sidecar_path
from gcs_plugin.params.transfer import Outcome, Source
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
    the least and the greatest value that such a vehicle takes, by id, and `gains` its own gain of each thruster, by the
    id of the accepted one.
    """

    values: dict[str, float]
    notes: tuple[str, ...] = ()
    whole: bool = False
    sidecar: Sidecar | None = None
    system: int | None = None
    left_out: frozenset[str] = frozenset()
    rigid: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    kept: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    gains: Mapping[str, float] = field(default_factory=dict)

    @property
    def intervals(self) -> Mapping[str, Interval]:
        return {} if self.sidecar is None else self.sidecar.intervals

    @property
    def warnings(self) -> tuple[str, ...]:
        """A line for each value that is doubted."""
        taken = {known.name for name in self.values if (known := coefficient_of(name)) is not None}
        doubted = {} if self.sidecar is None else self.sidecar.doubted
        return tuple(f"warning: {line}" for line in doubt_lines(doubted, taken))

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
    `option` is named as the way to send it all the same. With `any_vehicle`, any system may have the values.
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


COLUMNS = ("name", "on the vehicle", "in the file", "change", "unit", "last accepted", "Δ/±95%", "verdict")
NUMBERS = (*COLUMNS[1:4], *COLUMNS[5:7])
LEGEND = "Δ/±95%: the change, by half of the 95 % interval that the file gives; below 1 it is within it"
MOST_PERCENT = 999.0


@dataclass(frozen=True, slots=True)
class Compared:
    """Line of a plan, as `params diff --json` writes it; SI units, None if unknown.

    `low95` and `high95` are the target's 95 % interval, `change` is target minus present value in halves of it, None
    where the vehicle has none, an absent gain taken for 1; `accepted` is the value last accepted, at `accepted_at`;
    `doubted` says why the coefficient is doubted, "" if it is not.
    """

    name: str
    coefficient: str
    sentence: str
    unit: str
    present: float | None
    target: float
    low95: float | None
    high95: float | None
    accepted: float | None
    accepted_at: str | None
    change: float | None
    verdict: str
    reason: str
    doubted: str

    @property
    def changes(self) -> bool:
        """Whether an upload would write it."""
        return self.verdict == Verdict.CHANGED.value

    @property
    def staged(self) -> bool:
        """Whether the vehicle holds the value but does not use it: any upload puts it in force."""
        return self.verdict == Verdict.STAGED.value

    @property
    def implausible(self) -> bool:
        """Whether an upload would write it only if it is accepted by name."""
        return self.verdict == Verdict.IMPLAUSIBLE.value

    @property
    def choosable(self) -> bool:
        """Whether it can be written; an implausible value can be, once it is chosen."""
        return self.changes or self.implausible

    def acts_by(self, value: float | None) -> float | None:
        """The value by which the vehicle acts with `value`: an absent gain is a gain of 1."""
        return None if value is None else acting(self.name, value)

    def is_unset(self, value: float | None) -> bool:
        """Whether `value` is the 0 of a mass or damping, which says that there is none; see `plan.is_unset`."""
        return value is not None and is_unset(self.name, value)

    @property
    def percent(self) -> str:
        """The change relative to the present value: `+16 %`; "" if there is nothing to relate it to."""
        present = self.acts_by(self.present)
        if not present:
            return ""
        percent = 100 * (acting(self.name, self.target) - present) / abs(present)
        if abs(percent) > MOST_PERCENT:
            return f"{'>' if percent > 0 else '<-'}{MOST_PERCENT:.0f} %"
        return f"{percent:+.{0 if abs(percent) >= 10 else 1}f} %"

    def cells(self) -> tuple[str, ...]:
        """Texts of the table's cells, in the order of COLUMNS."""
        return (
            self.name,
            acting_text(self.name, self.present),
            acting_text(self.name, self.target),
            self.percent or "-",
            self.unit,
            acting_text(self.name, self.accepted),
            "-" if self.change is None else f"{self.change:+.1f}",
            f"{self.verdict}: {self.reason}" if self.reason else self.verdict,
        )


def compared(
    plan: Plan, sidecar: Sidecar | None, accepted: Mapping[str, AcceptedValue]
) -> tuple[Compared, ...]:
    """The lines of a plan, with intervals and doubts of their source, and the values last accepted."""
    intervals = {} if sidecar is None else sidecar.intervals
    doubted = {} if sidecar is None else sidecar.doubted
    return tuple(
        _compared(row, intervals.get(row.name), accepted.get(row.name), doubted) for row in plan.rows
    )


def _compared(
    row: Row, interval: Interval | None, last: AcceptedValue | None, doubted: Mapping[str, str]
) -> Compared:
    coefficient = coefficient_of(row.name)
    half = 0.0 if interval is None else (interval.high95 - interval.low95) / 2
    present = 0.0 if row.present is None else acting(row.name, row.present)
    return Compared(
        row.name,
        coefficient.name if coefficient else "",
        coefficient.sentence if coefficient else "",
        unit_of(row.name),
        row.present,
        row.target,
        None if interval is None else interval.low95,
        None if interval is None else interval.high95,
        None if last is None else last.value,
        None if last is None else last.time,
        (acting(row.name, row.target) - present) / half if present and half > 0.0 else None,
        row.verdict.value,
        row.reason,
        doubted.get(coefficient.name, "") if coefficient else "",
    )


@dataclass(frozen=True, slots=True)
class ComparedVehicle:
    """The component that was read."""

    system: int
    component: int
    armed: bool


@dataclass(frozen=True)
class Comparison:
    """A file compared with a vehicle, as `params diff --json` writes it.

    `outcome` is that of the identification `of` a dive, "" without a sidecar; `writes`: an upload would write
    something, if only a commit. `active_crc` and `staged_crc` are those of the set in use, 0 for none, and of the set
    that the vehicle holds: if they differ, the set held is not in use. None for a vehicle that takes no sets.
    `needs_disarmed`: an armed vehicle takes it only if that is said; `obstacle_armed`: why it does not even then.
    """

    summary: str
    file: str
    outcome: str
    of: str
    vehicle: ComparedVehicle
    ff_mode: float | None
    writes: bool
    active_crc: float | None
    staged_crc: int | None
    needs_disarmed: bool
    obstacle_armed: str
    notes: tuple[str, ...]
    parameters: tuple[Compared, ...]

    @property
    def doubted(self) -> bool:
        """Whether it comes from an identification that did not converge."""
        return self.outcome not in ("", CONVERGED)

    @property
    def changed(self) -> tuple[str, ...]:
        """Lines that an upload of the whole file would write."""
        return tuple(line.name for line in self.parameters if line.changes)

    @property
    def staged(self) -> tuple[str, ...]:
        """Lines that any upload would put in force without writing them."""
        return tuple(line.name for line in self.parameters if line.staged)

    @property
    def choosable(self) -> tuple[str, ...]:
        """Lines that can be written."""
        return tuple(line.name for line in self.parameters if line.choosable)

    @property
    def waits(self) -> bool:
        """Whether the vehicle holds values that are not in force; with no set in force, zero values do not count."""
        if self.staged_crc is None or self.active_crc in (None, self.staged_crc):
            return False
        return bool(self.active_crc) or any(line.present for line in self.parameters)

    def only(self, chosen: Collection[str]) -> tuple[str, ...]:
        """Names for `--only`: the chosen lines and the staged lines that take effect with them; empty for all lines."""
        if set(chosen) == set(self.choosable):
            return ()
        return tuple(line.name for line in self.parameters if line.staged or line.name in chosen)

    def half(self, chosen: Collection[str]) -> str:
        """Say which chosen line would leave half of a model without its other half, "" if none does."""
        values = {
            line.name: (line.target if line.staged or line.name in chosen else line.present) or 0.0
            for line in self.parameters
        }
        for line in self.parameters:
            # Another half outside the file is the vehicle's own, and was judged together with it.
            counterpart = other_half(line.name)
            if not line.changes or line.name not in chosen or counterpart not in values:
                continue
            if against := half_a_model(line.name, line.target, values):
                return f"{line.name}: {against}: choose {counterpart} too, or neither"
        return ""

    def accepted(self, chosen: Collection[str]) -> tuple[str, ...]:
        """Chosen lines that are written although they are implausible."""
        return tuple(line.name for line in self.parameters if line.implausible and line.name in chosen)

    @classmethod
    def from_json(cls, data: Any, source: str) -> "Comparison":
        """The comparison that `to_json` wrote; `source` names it in messages. Raises ConfigError for anything else."""
        return schema.build(cls, data, source)

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


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
        return [line.cells() for line in self.lines if Verdict(line.verdict) not in hidden]

    def order(self, receipts: Path, unix_s: float, *, even_armed: bool, read_at: Newest) -> Order:
        """The order to carry it out, at that time, with its receipt in the folder `receipts`."""
        sidecar = self.wanted.sidecar if self.whole and not self.restores else None
        preimage = new_preimage(receipts, unix_s)
        return Order(self.plan, preimage, even_armed, self.restores, sidecar, read_at)

    def settled(self, receipt: Receipt) -> tuple[Receipt, tuple[str, ...]]:
        """Write down the values that the vehicle accepted, see `keep_accepted`.

        Returns the lines to show, and the receipt, with `unkept` if they could not be written.
        """
        wrote = receipt.outcome is not Outcome.SAME
        lines = (
            [f"{receipt.outcome.value}: {receipt.sentence}", f"values before: {receipt.preimage}"]
            if wrote
            else [f"nothing to do: {receipt.sentence}"]
        )
        if not receipt.unkept:
            lines.insert(1, f"receipt: {path_of(receipt.preimage, RECEIPT)}")
            try:
                if (accepted := keep_accepted(receipt, self.wanted.sidecar, self.whole)) is not None:
                    lines.append(f"accepted: {accepted}")
            except ParamError as error:
                receipt = replace(receipt, unkept=str(error))
        return receipt, tuple(lines)

    def writes(self, vehicle: Source) -> bool:
        """Whether an upload would write something, if only a commit."""
        return Upload(self.plan.with_implausible(), vehicle).ending is None

    def comparison(self, vehicle: Source, *, armed: bool) -> Comparison:
        """The comparison with that vehicle, for other programs."""
        rehearsed, sidecar = Upload(self.plan.with_implausible(), vehicle), self.wanted.sidecar
        return Comparison(
            self.plan.summary(),
            str(self.file),
            sidecar.outcome if sidecar else "",
            sidecar.dive if sidecar else "",
            ComparedVehicle(*vehicle, armed),
            self.plan.present.get(MODE),
            rehearsed.ending is None,
            self.plan.present.get(ACTIVE),
            staged_crc(self.plan.present),
            rehearsed.needs_disarmed,
            obstacle(self.plan.present),
            self.notes,
            self.lines,
        )


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
    credits = () if wanted.sidecar is None else wanted.sidecar.credits
    doubted = implausible(plan, wanted.intervals, accepted, wanted.rigid, wanted.kept, credits, wanted.gains)
    plan = plan.judged({name: why for name, why in doubted.items() if name not in accepts})
    lines = compared(plan, wanted.sidecar, accepted)
    return Planned(file, wanted, plan, lines, tuple(back), left_behind(receipts, system, present, file))


def planned_back(
    file: Path, wanted: Wanted, present: Mapping[str, float], receipts: Path, system: int
) -> Planned:
    """Plan to go back to the values before an upload."""
    plan = make_plan(not_raised(wanted.values, present), present)
    lines = compared(plan, wanted.sidecar, last_accepted(receipts, system))
    left = left_behind(receipts, system, present, file)
    return Planned(file, wanted, plan, lines, left=left, restores=str(file))


def left_behind(
    receipts: Path, system: int, present: Mapping[str, float], file: Path | None = None
) -> tuple[str, ...]:
    """Sentences about the vehicle's staged set, and about an unfinished upload to it unless `file` settles that."""
    left = unfinished(receipts, system)
    if left is None or (file is not None and belongs(left, file)):
        return staging_notes(present)
    return (*staging_notes(present), *reminder(left, present))
