"""Messages about an unfinished upload: how much of it is on the vehicle, which set flies, and the remedy."""

from collections.abc import Mapping
from pathlib import Path

from bridge.parameters import ACTIVE
from gcs_plugin.params import float32
from gcs_plugin.params.last_accepted import Unfinished
from gcs_plugin.params.receipt import WANTED, path_of


def told(left: Unfinished, present: Mapping[str, float]) -> tuple[str, ...]:
    """Lines for the crew about an unfinished upload.

    `present` are the values on the vehicle now, empty if it was not read yet.
    """
    kind = "roll back" if left.restores else "upload"
    lines = [f"warning: the {kind} that was begun at {left.time} was never finished{_state(left, present)}"]
    if left.restores:
        finish, undo = f"rollback {left.restores}", f"rollback {left.preimage}"
        return (*lines, f"finish it: params {finish}; or take it back: params {undo}")
    return (*lines, f"finish it: params upload {path_of(left.preimage, WANTED)}; or go back: params rollback")


def _state(left: Unfinished, present: Mapping[str, float]) -> str:
    if not present:
        return ""
    there = sum(
        name in present and float32.same(present[name], value) for name, value in left.targets.items()
    )
    words = f": of its {len(left.targets)} values {there} are on the vehicle"
    active = present.get(ACTIVE)
    if left.active_crc is None or active is None:
        return words
    if float32.same(active, float(left.active_crc)):
        return f"{words}, and its set {left.active_crc} flies"
    return (
        f"{words}, and none of them flies: set {active:.0f} does"
        if there
        else f"{words}; set {active:.0f} flies"
    )


def belongs(left: Unfinished, file: Path) -> bool:
    """Whether uploading `file` finishes the upload or takes it back: then no message is needed."""
    remedies = (left.preimage, path_of(left.preimage, WANTED), Path(left.restores or left.preimage))
    return file.resolve() in {path.resolve() for path in remedies}
