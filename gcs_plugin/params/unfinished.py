"""An upload or roll back that was begun and never finished, and how the crew is told."""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

from bridge.text import typed
from bridge.vehicle.parameters import ACTIVE
from gcs_plugin.params import float32
from gcs_plugin.params.last_accepted import kept_of
from gcs_plugin.params.receipt import WANTED, PastUpload, path_of
from gcs_plugin.params.transfer import Outcome

_WROTE_NOTHING: Final = (Outcome.NOT_SENT, Outcome.REFUSED, Outcome.ROLLED_BACK)
"""Outcomes after which the vehicle holds the values from before."""


def unfinished(receipts: Path, system: int | None = None, vehicle: str = "") -> PastUpload | None:
    """The newest upload or roll back that was begun and never finished; None if a later upload or roll back has settled
    the values on its vehicle. `system` and `vehicle` restrict them as in `last_accepted`.
    """
    held: dict[int, set[str]] = {}
    settled: set[int] = set()
    for kept in reversed(kept_of(receipts, vehicle, system)):
        if kept.system in settled:
            continue
        of_vehicle = held.setdefault(kept.system, set())
        # A roll back without lines takes a set out of force, which no value tells.
        has_values = bool(kept.written or of_vehicle) or not kept.restores
        if kept.outcome is Outcome.BEGUN and not (has_values and of_vehicle >= set(kept.written)):
            return kept
        if kept.outcome is Outcome.SAME and not kept.restores:
            of_vehicle |= set(kept.targets)
        elif kept.outcome not in _WROTE_NOTHING:
            settled.add(kept.system)
    return None


def reminder(left: PastUpload, present: Mapping[str, float]) -> tuple[str, ...]:
    """Lines for the crew about an unfinished upload.

    `present` are the values on the vehicle now, empty if it was not read yet.
    """
    kind = "roll back" if left.restores else "upload"
    lines = [f"warning: the {kind} that was begun at {left.time} was never finished{_state(left, present)}"]
    if left.restores:
        finish, undo = (typed("params", "rollback", path) for path in (left.restores, left.preimage))
        return (*lines, f"finish it: {finish}; or take it back: {undo}")
    finish = typed("params", "upload", path_of(left.preimage, WANTED))
    return (*lines, f"finish it: {finish}; or go back: params rollback")


def _state(left: PastUpload, present: Mapping[str, float]) -> str:
    if not present:
        return ""
    there = sum(
        name in present and float32.same(present[name], value) for name, value in left.written.items()
    )
    words = f": of its {len(left.written)} values {there} are on the vehicle" if left.written else ""
    active = present.get(ACTIVE)
    if left.active_crc is None or active is None:
        return words
    if active == left.active_crc == 0:
        return f"{words}, and no set is in force"
    if float32.same(active, float(left.active_crc)):
        return f"{words}, and its set {left.active_crc} flies"
    return (
        f"{words}, and none of them flies: set {active:.0f} does"
        if there
        else f"{words}; set {active:.0f} flies"
    )


def belongs(left: PastUpload, file: Path) -> bool:
    """Whether uploading `file` finishes the upload or takes it back: then no message is needed."""
    remedies = (left.preimage, path_of(left.preimage, WANTED), Path(left.restores or left.preimage))
    return file.resolve() in {path.resolve() for path in remedies}
