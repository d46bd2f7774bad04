"""The values of a file compared with a vehicle.

The command, the app and MAVProxy show the same lines and notes.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from bridge.vehicle.parameters import MODE
from gcs_plugin.params.last_accepted import AcceptedValue
from gcs_plugin.params.meaning import acting, acting_text, coefficient_of, unit_of
from gcs_plugin.params.plan import Plan, Row, Verdict
from gcs_plugin.params.plausible import half_a_model, other_half
from gcs_plugin.params.sidecar import Interval, Sidecar
from gcs_plugin.params.wanted import CONVERGED

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

    @property
    def percent(self) -> str:
        """The change relative to the present value: `+16 %`; "" if there is nothing to relate it to."""
        present = 0.0 if self.present is None else acting(self.name, self.present)
        if not present or self.name == MODE:
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
