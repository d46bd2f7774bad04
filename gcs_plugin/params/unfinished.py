"""What to tell of an upload that the ground did not live to finish: what of it is there, what flies, and what to do."""

from collections.abc import Mapping
from pathlib import Path

from bridge.parameters import ACTIVE
from gcs_plugin.params import float32
from gcs_plugin.params.last_accepted import Unfinished
from gcs_plugin.params.receipt import WANTED, path_of


def told(left: Unfinished, present: Mapping[str, float]) -> tuple[str, ...]:
    """Lines for a crew; `present` is what the vehicle holds now, empty where it was not read yet."""
    what = "roll back" if left.restores else "upload"
    lines = [f"warning: the {what} that was begun at {left.time} was never finished{_state(left, present)}"]
    if left.restores:
        again, other = f"rollback {left.restores}", f"rollback {left.preimage}"
        return (*lines, f"finish it: params {again}; or take it back: params {other}")
    return (*lines, f"finish it: params upload {path_of(left.preimage, WANTED)}; or go back: params rollback")


def _state(left: Unfinished, present: Mapping[str, float]) -> str:
    if not present:
        return ""
    there = sum(
        name in present and float32.same(present[name], value) for name, value in left.targets.items()
    )
    told = f": of its {len(left.targets)} values {there} are on the vehicle"
    active = present.get(ACTIVE)
    if left.active_crc is None or active is None:
        return told
    if float32.same(active, float(left.active_crc)):
        return f"{told}, and its set {left.active_crc} flies"
    return (
        f"{told}, and none of them flies: set {active:.0f} does"
        if there
        else f"{told}; set {active:.0f} flies"
    )


def belongs(left: Unfinished, file: Path) -> bool:
    """Whether a file is what would finish it or take it back: then there is nothing to tell."""
    own = (left.preimage, path_of(left.preimage, WANTED), Path(left.restores or left.preimage))
    return file.resolve() in {path.resolve() for path in own}
