"""The receipt of an upload: what was asked, what was there before, what is there now, and how it is known.

It is on the disk before the first write, with the outcome BEGUN, and is replaced at the end: an upload that the ground
did not live to finish is known by it.
"""

import contextlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from itertools import count
from pathlib import Path
from typing import Any, Final

from bridge.errors import ParamRejected
from bridge.file_size import read_small
from bridge.folder_sync import sync_folder
from bridge.plain import from_json
from gcs_plugin.params.files import replace_text, unwritten, write_parameters
from gcs_plugin.params.plan import Plan, Verdict, unit_of
from gcs_plugin.params.sidecar import Sidecar, sidecar_path, write_sidecar
from gcs_plugin.params.transfer import Outcome, Result, Source
from gcs_plugin.params.upload import Ending

BEFORE: Final = "-before.param"
RECEIPT: Final = "-receipt.json"
WANTED: Final = "-wanted.param"
MOST_UPLOADS: Final = 2**53
"""A receipt that bears a larger number is none of ours."""


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
    -before.param that was gone back to, "" for an upload of anything else; `number` counts the uploads of a folder, and
    tells their order whatever the clock was set to; `unkept` is why it is not on the disk as it stands here, "" where
    it is."""

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
    number: int = 0
    unkept: str = ""

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
                    "unit": unit_of(line.name),
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
            "number": self.number,
            **({"unkept": self.unkept} if self.unkept else {}),
        }


def begin(
    plan: Plan,
    vehicle: Source,
    preimage: Path,
    active_crc: int | None,
    unix_s: float,
    restores: str = "",
    sidecar: Sidecar | None = None,
) -> Receipt:
    """Put on the disk what an upload needs to be finished or rolled back by another: the values before, what it is to
    write with what is known of that, and its receipt. Where an upload has the name `preimage` already it gets the next
    number: the receipt tells. Raises ParamUnwritten where that can't be: then nothing is to be sent, and none of these
    files is left, for they would look like an upload.
    """
    preimage = _claimed(preimage)
    wanted = path_of(preimage, WANTED)
    try:
        return _begun(plan, vehicle, preimage, active_crc, unix_s, restores, sidecar)
    except BaseException:
        _take_away(preimage, wanted, sidecar_path(wanted), path_of(preimage, RECEIPT))
        raise


def _begun(
    plan: Plan,
    vehicle: Source,
    preimage: Path,
    active_crc: int | None,
    unix_s: float,
    restores: str,
    sidecar: Sidecar | None,
) -> Receipt:
    started_utc = f"{datetime.fromtimestamp(unix_s, UTC):%Y-%m-%dT%H:%M:%SZ}"
    words = f"what vehicle {vehicle[0]}, component {vehicle[1]} held before an upload, {started_utc}"
    write_parameters(preimage, plan.present, (words,), *vehicle)
    begun = dict.fromkeys((Verdict.CHANGED, Verdict.STAGED), Outcome.BEGUN)
    outcomes = {**begun, Verdict.SAME: Outcome.SAME}
    lines = tuple(
        Line(row.name, row.present, row.target, None, outcomes.get(row.verdict, Outcome.NOT_SENT), "")
        for row in plan.rows
    )
    values = {line.name: line.target for line in lines if line.outcome is not Outcome.NOT_SENT}
    if values and not restores:
        wanted = path_of(preimage, WANTED)
        write_parameters(wanted, values, (f"what was to be written, {started_utc}",), *vehicle)
        if sidecar is not None:
            write_sidecar(wanted, sidecar)
    receipt = Receipt(
        Outcome.BEGUN,
        Outcome.BEGUN.value,
        *vehicle,
        lines,
        preimage,
        active_crc,
        started_utc,
        0.0,
        restores,
        next_number(preimage.parent),
    )
    _keep(receipt)
    return receipt


def finish(begun: Receipt, plan: Plan, ending: Ending, took_s: float) -> Receipt:
    """The receipt of an upload that was begun so and has ended, kept in place of that.

    Where it can't be written it says so itself: what the vehicle holds by now comes first, and the one on the disk
    still says that the upload was begun.
    """
    receipt = replace(
        begun,
        outcome=ending.outcome,
        sentence=ending.sentence,
        lines=lines_of(plan, ending.results),
        took_s=took_s,
    )
    try:
        _keep(receipt)
    except ParamRejected as error:
        again = f"`seatrial params {'rollback' if receipt.restores else 'upload'}`"
        why = f"its receipt still says that it was begun: {error}, or free disk space; the same {again} once more "
        return replace(receipt, unkept=why + "then writes down what the vehicle holds")
    wanted = path_of(receipt.preimage, WANTED)
    _take_away(wanted, sidecar_path(wanted))
    return receipt


def _take_away(*paths: Path) -> None:
    for path in paths:
        with contextlib.suppress(OSError):  # it is only no longer needed
            path.unlink()


def next_number(folder: Path) -> int:
    """One more than any receipt in a folder bears; never one that could not be read again."""
    return min(1 + max((number_in(path) for path in folder.glob(f"*{RECEIPT}")), default=0), MOST_UPLOADS)


def number_in(path: Path) -> int:
    """The number that a receipt bears; 0 for an older one, and one that can't be read."""
    try:
        return whole(from_json(read_small(path))["number"], MOST_UPLOADS)
    except (OSError, ValueError, KeyError, TypeError):
        return 0


def whole(told: Any, most: int) -> int:
    """A whole number of a receipt, from 0 on. Raises ValueError for anything else."""
    if isinstance(told, bool) or not isinstance(told, int) or not 0 <= told <= most:
        raise ValueError(f"no whole number from 0 to {most}")
    return told


def new_preimage(folder: Path, unix_s: float) -> Path:
    """The pre-image of an upload that begins now; `begin` numbers it where another has that name."""
    return folder / f"{datetime.fromtimestamp(unix_s, UTC):%Y-%m-%dT%H%M%SZ}{BEFORE}"


def _claimed(preimage: Path) -> Path:
    """That file or, where it or its receipt is there, the next number of it: new and empty, whoever else begins now.

    Raises ParamUnwritten where none can be made.
    """
    tail = BEFORE if preimage.name.endswith(BEFORE) else preimage.suffix
    stem, found = preimage.name.removesuffix(tail), preimage
    try:
        found.parent.mkdir(parents=True, exist_ok=True)
        for number in count(2):
            with contextlib.suppress(FileExistsError):
                if not path_of(found, RECEIPT).exists():
                    found.touch(exist_ok=False)
                    break
            found = preimage.with_name(f"{stem}-{number}{tail}")
    except OSError as error:
        raise unwritten(preimage, error) from None
    return found


def path_of(preimage: Path, kind: str) -> Path:
    """Another file of the upload that has this pre-image: its RECEIPT, say."""
    return preimage.with_name(preimage.name.removesuffix(BEFORE) + kind)


def _keep(receipt: Receipt) -> None:
    path = path_of(receipt.preimage, RECEIPT)
    replace_text(path, json.dumps(receipt.to_json(), indent=2, allow_nan=False) + "\n")
    sync_folder(path.parent)


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
