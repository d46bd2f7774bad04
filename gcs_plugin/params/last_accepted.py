"""The parameter values last accepted: uploaded to a vehicle, verified, and not rolled back since.

An upload leaves, under its time (UTC), TIME-before.param and TIME-receipt.json, and if all of it was verified also
TIME-accepted.param with its sidecar. The receipt of an unfinished upload says BEGUN, and TIME-wanted.param holds the
values that were to be written. A verified roll back to TIME-before.param takes back that upload and all later uploads;
a roll back to a file of another name takes back all uploads.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from bridge.errors import ParamError, ParamRejected
from bridge.files import read_small
from bridge.plain import from_json
from bridge.vehicle.parameters import ACTIVE
from gcs_plugin.params import float32
from gcs_plugin.params.files import (
    Interval,
    Sidecar,
    read_parameters,
    read_sidecar,
    write_parameters,
    write_sidecar,
)
from gcs_plugin.params.plan import coefficient_of
from gcs_plugin.params.receipt import BEFORE, MOST_UPLOADS, RECEIPT, WANTED, Receipt, path_of, whole
from gcs_plugin.params.transfer import Outcome

ACCEPTED: Final = "-accepted.param"

_LARGEST_CRC: Final = 2**32 - 1

_TIME = re.compile(r"\d{4}-\d\d-\d\dT\d{6}Z(-\d+)?")
_HELD: Final = (Outcome.APPLIED, Outcome.SAME)
_HELD_WORDS: Final = tuple(outcome.name.lower() for outcome in _HELD)
_BEGUN: Final = Outcome.BEGUN.name.lower()
_OPEN_WORDS: Final = (_BEGUN, Outcome.UNVERIFIED.name.lower())
_AS_BEFORE_WORDS: Final = tuple(
    outcome.name.lower() for outcome in (Outcome.NOT_SENT, Outcome.REFUSED, Outcome.ROLLED_BACK)
)


@dataclass(frozen=True, slots=True)
class AcceptedValue:
    """Parameter value as last accepted.

    `interval` is its 95 % interval, None if the source gave none; `time` is the upload's time as in the file name.
    """

    value: float
    interval: Interval | None
    time: str


@dataclass(frozen=True, slots=True)
class Unfinished:
    """An upload or roll back that the ground station began and never finished.

    `time` is that of its file names; `preimage` is the file with the values before; `restores` is the file that a roll
    back was to go back to, "" for an upload; `targets` are the values to write; `active_crc` is the CRC of the set that
    was to fly, None without a commit.
    """

    time: str
    preimage: Path
    restores: str
    targets: Mapping[str, float]
    active_crc: int | None


@dataclass(frozen=True, slots=True)
class _Kept:
    number: int
    time: str
    outcome: str
    restores: str
    targets: Mapping[str, float]
    written: Mapping[str, float]
    active_crc: int | None


def keep_accepted(receipt: Receipt, sidecar: Sidecar | None, complete: bool) -> Path | None:
    """Write the verified values of a good receipt to TIME-accepted.param, with the part of `sidecar` about them.

    Returns the path, or None if nothing is kept: the receipt is not good, is a roll back, or has no verified line.
    `complete`: all lines of the source were sent, so its effects hold too. Raises ParamUnwritten if the files can't
    be written.
    """
    values = {line.name: line.target for line in receipt.lines if line.outcome in _HELD}
    if not receipt.good or receipt.restores or not values:
        return None
    path = path_of(receipt.preimage, ACCEPTED)
    words = f"what vehicle {receipt.system}, component {receipt.component} accepted, {receipt.started_utc}"
    write_parameters(path, values, (words,), receipt.system, receipt.component)
    if sidecar is not None:
        coefficients = {known.name for name in values if (known := coefficient_of(name)) is not None}
        write_sidecar(
            path,
            replace(
                sidecar,
                intervals={name: known for name, known in sidecar.intervals.items() if name in values},
                doubted={name: why for name, why in sidecar.doubted.items() if name in coefficients},
                effects=sidecar.effects if complete else (),
            ),
        )
    return path


def last_accepted(receipts: Path, system: int | None = None) -> dict[str, AcceptedValue]:
    """Last accepted value of each parameter, by id, from the files in the folder `receipts`.

    `system` restricts them to a MAVLink system. Files that can't be read are left out.
    """
    accepted: dict[str, AcceptedValue] = {}
    for kept in _standing(receipts, system):
        path = receipts / f"{kept.time}{ACCEPTED}"
        try:
            values, sidecar = read_parameters(path), read_sidecar(path)
        except ParamError:
            continue
        intervals = sidecar.intervals if sidecar is not None else {}
        accepted |= {
            name: AcceptedValue(value, intervals.get(name), kept.time) for name, value in values.items()
        }
    return accepted


def newest_before(receipts: Path, system: int | None = None) -> Path | None:
    """Pre-image for a roll back in one step: the values before the newest upload that wrote and was not rolled back.

    If uploads with an unknown end (begun or unverified) precede it, with no applied upload in between, it is the
    pre-image of the first of these. None if there is no such upload.
    """
    oldest: _Kept | None = None
    for kept in reversed(_standing(receipts, system)):
        if kept.outcome in _OPEN_WORDS or (oldest is None and kept.outcome == Outcome.APPLIED.name.lower()):
            oldest = kept
        elif oldest is not None and kept.outcome == Outcome.APPLIED.name.lower():
            break
    return None if oldest is None else receipts / f"{oldest.time}{BEFORE}"


def before_newest(receipts: Path, system: int) -> Path:
    """Like `newest_before`, for a given MAVLink system. Raises ParamRejected if no upload to it can be rolled back."""
    preimage = newest_before(receipts, system)
    if preimage is None:
        raise ParamRejected(
            f"{receipts}: no upload to vehicle {system} that stands is kept there; give the -before.param to go back to"
        )
    return preimage


def unfinished(receipts: Path, system: int | None = None) -> Unfinished | None:
    """The newest upload or roll back that was begun and never finished; None if a later upload or roll back has settled
    the values on the vehicle.
    """
    held: set[str] = set()
    for kept in reversed(_in_order(receipts, system)):
        if kept.outcome == _BEGUN:
            if held >= set(kept.written):
                return None
            preimage = receipts / f"{kept.time}{BEFORE}"
            return Unfinished(kept.time, preimage, kept.restores, kept.written, kept.active_crc)
        if kept.outcome == Outcome.SAME.name.lower() and not kept.restores:
            held |= set(kept.targets)
        elif kept.outcome not in _AS_BEFORE_WORDS:
            return None
    return None


def _in_order(receipts: Path, system: int | None) -> list[_Kept]:
    """All uploads and roll backs, the newest last, ordered by number: a clock may be set back, a number never is."""
    begun = _read_all(receipts.glob(f"*{RECEIPT}"), system)
    return sorted(begun, key=lambda kept: (kept.number, kept.time))


def _standing(receipts: Path, system: int | None) -> list[_Kept]:
    """Uploads that no later roll back has undone, the newest last."""
    standing: list[_Kept] = []
    begun = _in_order(receipts, system)
    for kept in begun:
        if not kept.restores:
            standing.append(kept)
        elif kept.outcome in _HELD_WORDS:
            back_to = Path(kept.restores).name.removesuffix(BEFORE)
            place = next((n for n, upload in enumerate(begun) if upload.time == back_to), 0)
            taken = {upload.time for upload in begun[place:]}
            standing = [upload for upload in standing if upload.time not in taken]
    return standing


def _read_all(paths: Iterable[Path], system: int | None) -> Iterator[_Kept]:
    for path in paths:
        time = path.name.removesuffix(RECEIPT)
        if not _TIME.fullmatch(time):
            continue
        try:
            data: Any = from_json(read_small(path))
            holder, restores, crc = (
                data["vehicle"]["system"],
                data.get("restores") or "",
                data.get("active_crc"),
            )
            lines = data.get("parameters", ())
            targets = {str(line["name"]): float32.rounded(line["target"]) for line in lines}
            begun = (str(line["name"]) for line in lines if line["outcome"] == _BEGUN)
            kept = _Kept(
                whole(data.get("number", 0), MOST_UPLOADS),
                time,
                str(data["outcome"]),
                str(restores),
                targets,
                {name: targets[name] for name in begun},
                None if crc is None else whole(crc, _LARGEST_CRC),
            )
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            continue
        if system in (None, holder):
            yield kept


def reminder(left: Unfinished, present: Mapping[str, float]) -> tuple[str, ...]:
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
