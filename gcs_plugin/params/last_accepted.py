"""What was last accepted: uploaded to a vehicle, verified, and not taken back since.

An upload leaves, under its time (UTC), TIME-before.param and TIME-receipt.json, and where all of it was verified
TIME-accepted.param with its sidecar. Of one that was never finished the receipt says BEGUN, and TIME-wanted.param what
it was to write. A verified roll back to TIME-before.param takes back that upload and all later ones; one to a file of
another name takes back all.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from bridge.errors import ParamError, ParamRejected
from bridge.file_size import read_small
from bridge.plain import from_json
from gcs_plugin.params import float32
from gcs_plugin.params.files import read_parameters, write_parameters
from gcs_plugin.params.plan import coefficient_of
from gcs_plugin.params.receipt import BEFORE, MOST_UPLOADS, RECEIPT, Receipt, path_of, whole
from gcs_plugin.params.sidecar import Interval, Sidecar, read_sidecar, write_sidecar
from gcs_plugin.params.transfer import Outcome

ACCEPTED: Final = "-accepted.param"

OR_A_FILE: Final = "; give the -before.param to go back to"
"""Ends the sentence that nothing is left to take back, for whoever can give a file."""

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
    """A parameter as last accepted; `interval` (95 %) where its source told one, `time` as in its file's name."""

    value: float
    interval: Interval | None
    time: str


@dataclass(frozen=True, slots=True)
class Unfinished:
    """An upload that the ground did not live to finish; `restores` is the file that it was to go back to, "" for none.

    `targets` is what it was to write, `before` what was there then, `active_crc` the set that was to fly.
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


def keep_accepted(receipt: Receipt, sidecar: Sidecar | None, whole: bool) -> Path | None:
    """Keep beside a good receipt what the vehicle holds of it now, and what `sidecar` says of these lines.

    None where nothing was to be kept. `whole`: all lines of the source were sent, so that its effects hold too. Raises
    ParamUnwritten where it can't be written.
    """
    values = {line.name: line.target for line in receipt.lines if line.outcome in _HELD}
    if not receipt.good or receipt.restores or not values:
        return None
    path = path_of(receipt.preimage, ACCEPTED)
    words = f"what vehicle {receipt.system}, component {receipt.component} accepted, {receipt.started_utc}"
    write_parameters(path, values, (words,), receipt.system, receipt.component)
    if sidecar is not None:
        coefficients = {one.name for name in values if (one := coefficient_of(name)) is not None}
        write_sidecar(
            path,
            replace(
                sidecar,
                intervals={name: one for name, one in sidecar.intervals.items() if name in values},
                doubted={name: why for name, why in sidecar.doubted.items() if name in coefficients},
                effects=sidecar.effects if whole else (),
            ),
        )
    return path


def last_accepted(receipts: Path, system: int | None = None) -> dict[str, AcceptedValue]:
    """Each parameter as it was last accepted, by id, from the files in `receipts`; of one MAVLink system, or of any.

    What can't be read is left out.
    """
    found: dict[str, AcceptedValue] = {}
    for kept in _standing(receipts, system):
        path = receipts / f"{kept.time}{ACCEPTED}"
        try:
            values, sidecar = read_parameters(path), read_sidecar(path)
        except ParamError:
            continue
        intervals = sidecar.intervals if sidecar is not None else {}
        found |= {
            name: AcceptedValue(value, intervals.get(name), kept.time) for name, value in values.items()
        }
    return found


def newest_before(receipts: Path, system: int | None = None) -> Path | None:
    """What a roll back in one step goes back to: the values before the newest upload that wrote and stands.

    Where that one was to mend others whose end is not known, it is the values before the first of these.
    """
    found: _Kept | None = None
    for kept in reversed(_standing(receipts, system)):
        if kept.outcome in _OPEN_WORDS or (found is None and kept.outcome == Outcome.APPLIED.name.lower()):
            found = kept
        elif found is not None and kept.outcome == Outcome.APPLIED.name.lower():
            break
    return None if found is None else receipts / f"{found.time}{BEFORE}"


def before_newest(receipts: Path, system: int) -> Path:
    """As `newest_before`, of one MAVLink system. Raises ParamRejected where no upload to it stands."""
    found = newest_before(receipts, system)
    if found is None:
        raise ParamRejected(f"{receipts}: no upload to vehicle {system} that stands is kept there{OR_A_FILE}")
    return found


def unfinished(receipts: Path, system: int | None = None) -> Unfinished | None:
    """The upload or roll back that was begun and never finished, unless another has settled since what the vehicle
    holds."""
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
    """All that was begun, the newest last; a clock may have been set back meanwhile, a number never is."""
    found = _read_all(receipts.glob(f"*{RECEIPT}"), system)
    return sorted(found, key=lambda one: (one.number, one.time))


def _standing(receipts: Path, system: int | None) -> list[_Kept]:
    """Uploads that no later roll back took back, the newest last."""
    standing: list[_Kept] = []
    begun = _in_order(receipts, system)
    for kept in begun:
        if not kept.restores:
            standing.append(kept)
        elif kept.outcome in _HELD_WORDS:
            back_to = Path(kept.restores).name.removesuffix(BEFORE)
            place = next((n for n, one in enumerate(begun) if one.time == back_to), 0)
            taken = {one.time for one in begun[place:]}
            standing = [one for one in standing if one.time not in taken]
    return standing


def _read_all(paths: Iterable[Path], system: int | None) -> Iterator[_Kept]:
    for path in paths:
        time = path.name.removesuffix(RECEIPT)
        if not _TIME.fullmatch(time):
            continue
        try:
            data: Any = from_json(read_small(path))
            of, restores, crc = data["vehicle"]["system"], data.get("restores") or "", data.get("active_crc")
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
        if system in (None, of):
            yield kept
