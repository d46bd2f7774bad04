"""An upload or a roll back as proposed to the operator: its plan, line by line compared with the vehicle.

Once agreed to, it becomes an order, and its receipt is settled here too.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

from bridge.errors import ParamError, ParamUnknown
from bridge.vehicle.mode import Mode
from bridge.vehicle.parameters import ACTIVE, MODE
from gcs_plugin.params.comparison import Compared, ComparedVehicle, Comparison, compared
from gcs_plugin.params.last_accepted import keep_accepted, last_accepted, vehicle_in, written_since
from gcs_plugin.params.meaning import is_staged
from gcs_plugin.params.plan import (
    HULL,
    NO_HULL,
    Plan,
    Verdict,
    make_plan,
    not_raised,
    obstacle,
    staged_crc,
    staging_notes,
    taken_back,
)
from gcs_plugin.params.plausible import acts_twice, implausible
from gcs_plugin.params.receipt import RECEIPT, Newest, Receipt, new_preimage, path_of
from gcs_plugin.params.session import Order
from gcs_plugin.params.sidecar import sidecar_path
from gcs_plugin.params.transfer import Outcome
from gcs_plugin.params.unfinished import belongs, reminder, unfinished
from gcs_plugin.params.upload import Upload
from gcs_plugin.params.wanted import Wanted
from gcs_plugin.peers import Source

TAKEN_BACK: Final = "no part of this model, taken back"


@dataclass(frozen=True)
class Proposal:
    """A plan, line by line compared with the values last accepted.

    `back` are the effects that it takes back, `left` sentences about the vehicle's staged set and an unfinished
    upload; `restores` is the file that a roll back goes back to, "" for an upload. `twice` are reasons against gains
    that the vehicle holds already and that act on top of its own, by id.
    """

    file: Path
    wanted: Wanted
    plan: Plan
    lines: tuple[Compared, ...]
    back: tuple[str, ...] = ()
    left: tuple[str, ...] = ()
    restores: str = ""
    twice: Mapping[str, str] = field(default_factory=dict)

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
        twice = (
            f"warning: the vehicle holds {name}: {why}; take it back (seatrial params rollback), or that gain out of "
            "the vehicle's own file"
            for name, why in self.twice.items()
        )
        return (*self.left, *unchecked, *self.wanted.notes, *self.wanted.warnings, *twice, *back)

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


def propose_upload(
    file: Path,
    wanted: Wanted,
    present: Mapping[str, float],
    only: Collection[str] | None,
    receipts: Path,
    system: int,
    accepts: Collection[str] = (),
) -> Proposal:
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
    accepted = last_accepted(receipts, system, wanted.vehicle)
    credits = () if wanted.sidecar is None else wanted.sidecar.credits
    doubted = implausible(plan, wanted.intervals, accepted, wanted.rigid, wanted.kept, credits, wanted.gains)
    plan = plan.judged({name: why for name, why in doubted.items() if name not in accepts})
    lines, left = (
        compared(plan, wanted.sidecar, accepted),
        left_behind(receipts, system, present, file, wanted.vehicle),
    )
    twice = acts_twice(plan, credits, wanted.gains)
    return Proposal(file, wanted, plan, lines, tuple(back), left, twice=twice)


def propose_rollback(
    file: Path, wanted: Wanted, present: Mapping[str, float], receipts: Path, system: int
) -> Proposal:
    """Plan to go back to the values before an upload, of what it and later uploads wrote alone.

    The file holds all that the vehicle held then, and what others have set since is theirs. A set is one thing: if any
    of it was written, all of it goes back, and the mode is lowered with it. Where none was in force before,
    none is in the end. A file without a receipt is taken as a whole.
    """
    wrote, of_set, vehicle = written_since(receipts, system, file), False, wanted.vehicle or vehicle_in(file)
    values, left = wanted.values, left_behind(receipts, system, present, file, vehicle)
    if wrote is None:
        left = (*left, f"note: no receipt tells what was written after {file.name}: all its lines go back")
    else:
        of_set = any(map(is_staged, wrote))
        values = {
            name: value
            for name, value in values.items()
            if name in wrote or (of_set and (is_staged(name) or name == MODE))
        }
    withdraws = wrote is not None and wanted.values.get(ACTIVE) == 0.0 and of_set
    if withdraws:
        mark = {HULL: NO_HULL} if HULL in present else {}
        values = {**values, **mark, MODE: float(Mode.OFF)}
    plan = replace(make_plan(not_raised(values, present), present), withdraws=withdraws)
    lines = compared(plan, wanted.sidecar, last_accepted(receipts, system, vehicle))
    return Proposal(file, wanted, plan, lines, left=left, restores=str(file))


def left_behind(
    receipts: Path, system: int, present: Mapping[str, float], file: Path | None = None, vehicle: str = ""
) -> tuple[str, ...]:
    """Sentences about the vehicle's staged set, and about an unfinished upload to it unless `file` settles that.
    `vehicle` is its name, "" if that is unknown."""
    left = unfinished(receipts, system, vehicle)
    if left is None or (file is not None and belongs(left, file)):
        return staging_notes(present)
    return (*staging_notes(present), *reminder(left, present))
