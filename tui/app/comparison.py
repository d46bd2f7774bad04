"""The vehicle's parameters against a file's and the last accepted values, from the output of `params diff --json`."""

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from gcs_plugin.params.plausible import half_a_model, other_half

CHANGED: Final = "changed"
IMPLAUSIBLE: Final = "implausible"
STAGED: Final = "staged"
READ_ONLY: Final = "read-only"
CONVERGED: Final = "converged"
ACTING: Final = (2, 3)


@dataclass(frozen=True, slots=True)
class Entry:
    """One parameter in `unit`; None if the vehicle lacks it, no interval is known, or no value was accepted.

    `change` is in halves of the 95 % interval `low95` to `high95`; `doubted` gives the doubts about the value.
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
    accepted_at: str
    change: float | None
    verdict: str
    reason: str
    doubted: str

    @property
    def changes(self) -> bool:
        """Whether an upload would write it."""
        return self.verdict == CHANGED

    @property
    def staged(self) -> bool:
        """Whether the vehicle holds the value but does not use it: any upload puts it in force."""
        return self.verdict == STAGED

    @property
    def implausible(self) -> bool:
        """Whether an upload would write it only if it is accepted by name."""
        return self.verdict == IMPLAUSIBLE

    @property
    def choosable(self) -> bool:
        """Whether it can be written; an implausible value can be, once it is chosen."""
        return self.changes or self.implausible


@dataclass(frozen=True)
class Comparison:
    """Result of comparing a file with a vehicle. `active_crc` and `staged_crc` are the checksums of the parameter set
    in force, 0 for none, and of the set that the vehicle holds; None if the vehicle has no sets.

    `needs_disarmed`: it changes more than an armed vehicle accepts without confirmation; `of` is the dive it comes
    from.
    """

    file: Path
    of: str
    outcome: str
    summary: str
    notes: tuple[str, ...]
    system: int
    armed: bool
    ff_mode: int | None
    active_crc: int | None
    staged_crc: int | None
    needs_disarmed: bool
    entries: tuple[Entry, ...]

    @property
    def doubted(self) -> bool:
        """Whether it comes from an identification that did not converge."""
        return self.outcome not in ("", CONVERGED)

    @property
    def changed(self) -> tuple[str, ...]:
        """Lines that an upload of the whole file would write."""
        return tuple(entry.name for entry in self.entries if entry.changes)

    @property
    def waits(self) -> bool:
        """Whether the vehicle holds values that are not in force; with no set in force, zero values do not count."""
        if self.staged_crc is None or self.active_crc in (None, self.staged_crc):
            return False
        return bool(self.active_crc) or any(entry.present for entry in self.entries)

    @property
    def staged(self) -> tuple[str, ...]:
        """Lines that any upload would put in force without writing them."""
        return tuple(entry.name for entry in self.entries if entry.staged)

    @property
    def choosable(self) -> tuple[str, ...]:
        """Lines that can be written."""
        return tuple(entry.name for entry in self.entries if entry.choosable)

    def only(self, chosen: Collection[str]) -> tuple[str, ...]:
        """Names for `--only`: the chosen lines and the staged lines that take effect with them; empty for all lines."""
        if set(chosen) == set(self.choosable):
            return ()
        return tuple(entry.name for entry in self.entries if entry.staged or entry.name in chosen)

    def half(self, chosen: Collection[str]) -> str:
        """Say which chosen line would leave half of a model without its other half, "" if none does."""
        values = {
            entry.name: (entry.target if entry.staged or entry.name in chosen else entry.present) or 0.0
            for entry in self.entries
        }
        for entry in self.entries:
            # Another half outside the file is the vehicle's own, and was judged together with it.
            counterpart = other_half(entry.name)
            if not entry.changes or entry.name not in chosen or counterpart not in values:
                continue
            if against := half_a_model(entry.name, entry.target, values):
                return f"{entry.name}: {against}: choose {counterpart} too, or neither"
        return ""

    def accepted(self, chosen: Collection[str]) -> tuple[str, ...]:
        """Chosen lines that are written although they are implausible."""
        return tuple(entry.name for entry in self.entries if entry.implausible and entry.name in chosen)


def comparison(data: Any) -> Comparison | None:
    """Parse the comparison that a verb left; None if it is missing or not a comparison."""
    try:
        vehicle = data["vehicle"]
        rows = [row for row in data["parameters"] if row["verdict"] != READ_ONLY]
        return Comparison(
            Path(data["file"]),
            str(data["of"]),
            str(data["outcome"]),
            str(data["summary"]),
            tuple(map(str, data["notes"])),
            int(vehicle["system"]),
            bool(vehicle["armed"]),
            _whole(data["ff_mode"]),
            _whole(data["active_crc"]),
            _whole(data["staged_crc"]),
            bool(data["needs_disarmed"]),
            tuple(Entry(**{field: row[field] for field in Entry.__slots__}) for row in rows),
        )
    except (KeyError, TypeError, ValueError):
        return None


def _whole(value: Any) -> int | None:
    return None if value is None else int(value)
