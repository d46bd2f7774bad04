"""What was last accepted: uploaded to a vehicle, verified, and not taken back since.

An upload leaves, under its time (UTC), TIME-before.param and TIME-receipt.json, and where all of it was verified
TIME-accepted.param with its sidecar. A verified roll back to TIME-before.param takes back that upload and all later
ones; one to a file of another name takes back all.
"""

import json
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from bridge.errors import ParamError
from gcs_plugin.params.files import read_parameters, write_parameters
from gcs_plugin.params.plan import coefficient_of
from gcs_plugin.params.receipt import Receipt
from gcs_plugin.params.sidecar import Interval, Sidecar, read_sidecar, write_sidecar
from gcs_plugin.params.transfer import Outcome

BEFORE: Final = "-before.param"
RECEIPT: Final = "-receipt.json"
ACCEPTED: Final = "-accepted.param"

_TIME = re.compile(r"\d{4}-\d\d-\d\dT\d{6}Z(-\d+)?")
_HELD: Final = (Outcome.APPLIED, Outcome.SAME)
_HELD_WORDS: Final = tuple(outcome.name.lower() for outcome in _HELD)


@dataclass(frozen=True, slots=True)
class AcceptedValue:
    """A parameter as last accepted; `interval` (95 %) where its source told one, `time` as in its file's name."""

    value: float
    interval: Interval | None
    time: str


@dataclass(frozen=True, slots=True)
class _Kept:
    time: str
    outcome: str
    restores: str | None


def keep_accepted(receipt: Receipt, sidecar: Sidecar | None, whole: bool) -> Path | None:
    """Keep beside a good receipt what the vehicle holds of it now, and what `sidecar` says of these lines.

    None where nothing was to be kept. `whole`: all lines of the source were sent, so that its effects hold too. Raises
    ParamRejected where it can't be written.
    """
    values = {line.name: line.target for line in receipt.lines if line.outcome in _HELD}
    if not receipt.good or receipt.restores or not values:
        return None
    path = receipt.preimage.with_name(receipt.preimage.name.removesuffix(BEFORE) + ACCEPTED)
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
    """What a roll back in one step goes back to: the values before the newest upload that wrote and stands."""
    written = (Outcome.APPLIED.name.lower(), Outcome.UNVERIFIED.name.lower())
    stems = [kept.time for kept in _standing(receipts, system) if kept.outcome in written]
    return receipts / f"{stems[-1]}{BEFORE}" if stems else None


def _standing(receipts: Path, system: int | None) -> list[_Kept]:
    """Uploads that no later roll back took back, the newest last."""
    standing: list[_Kept] = []
    for kept in sorted(_read_all(receipts.glob(f"*{RECEIPT}"), system), key=lambda one: one.time):
        if kept.restores is None:
            standing.append(kept)
        elif kept.outcome in _HELD_WORDS:
            back_to = kept.restores.removesuffix(BEFORE)
            known = _TIME.fullmatch(back_to) is not None
            standing = [one for one in standing if known and one.time < back_to]
    return standing


def _read_all(paths: Iterable[Path], system: int | None) -> Iterator[_Kept]:
    for path in paths:
        time = path.name.removesuffix(RECEIPT)
        if not _TIME.fullmatch(time):
            continue
        try:
            data: Any = json.loads(path.read_text(encoding="utf-8"))
            of, restores = data["vehicle"]["system"], data.get("restores") or None
            kept = _Kept(time, str(data["outcome"]), None if restores is None else Path(str(restores)).name)
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            continue
        if system in (None, of):
            yield kept
