"""The parameter values last accepted: uploaded to a vehicle, verified, and not rolled back since.

An upload leaves, under its time (UTC), TIME-before.param and TIME-receipt.json, and if all of it was verified also
TIME-accepted.param with its sidecar. The receipt of an unfinished upload says BEGUN, and TIME-wanted.param holds the
values that were to be written. A verified roll back to TIME-before.param takes back that upload and all later uploads;
a roll back to a file of another name takes back all uploads.
"""

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from bridge.errors import ParamError, ParamRejected
from gcs_plugin.params.files import read_parameters, write_parameters
from gcs_plugin.params.meaning import coefficient_of
from gcs_plugin.params.receipt import BEFORE, WANTED, PastUpload, Receipt, kept_in, path_of, receipt_of
from gcs_plugin.params.sidecar import Interval, Sidecar, read_sidecar, write_with_sidecar
from gcs_plugin.params.transfer import Outcome

ACCEPTED: Final = "-accepted.param"

_HELD: Final = (Outcome.APPLIED, Outcome.SAME)
_OPEN: Final = (Outcome.BEGUN, Outcome.UNVERIFIED)


@dataclass(frozen=True, slots=True)
class AcceptedValue:
    """Parameter value as last accepted.

    `interval` is its 95 % interval, None if the source gave none; `time` is the upload's time as in the file name.
    """

    value: float
    interval: Interval | None
    time: str


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
    if sidecar is None:
        write_parameters(path, values, (words,), receipt.system, receipt.component)
        return path
    coefficients = {known.name for name in values if (known := coefficient_of(name)) is not None}
    about_these = replace(
        sidecar,
        intervals={name: known for name, known in sidecar.intervals.items() if name in values},
        doubted={name: why for name, why in sidecar.doubted.items() if name in coefficients},
        effects=sidecar.effects if complete else (),
        foretold=sidecar.foretold if complete else (),
    )
    write_with_sidecar(path, values, (words,), about_these, receipt.system, receipt.component)
    return path


def last_accepted(receipts: Path, system: int | None = None, vehicle: str = "") -> dict[str, AcceptedValue]:
    """Last accepted value of each parameter, by id, from the files in the folder `receipts`.

    `system` restricts them to a MAVLink system, `vehicle` to those that are of no other vehicle by the name in its
    file. Files that can't be read are left out.
    """
    accepted: dict[str, AcceptedValue] = {}
    for kept in _not_undone(kept_in(receipts, system)):
        path = path_of(kept.preimage, ACCEPTED)
        try:
            values, sidecar = read_parameters(path), read_sidecar(path)
        except ParamError:
            continue
        if vehicle and sidecar is not None and sidecar.vehicle not in ("", vehicle):
            continue
        intervals = sidecar.intervals if sidecar is not None else {}
        accepted |= {
            name: AcceptedValue(value, intervals.get(name), kept.time) for name, value in values.items()
        }
    return accepted


def accepted_of(file: Path, receipts: Path) -> dict[str, AcceptedValue]:
    """`last_accepted` of the vehicle that a parameter file is of. Raises ParamRejected for a damaged sidecar."""
    return last_accepted(receipts, vehicle=vehicle_in(file))


def vehicle_in(file: Path) -> str:
    """The name of the vehicle that a parameter file is of, "" if nothing names it: by its sidecar, or by its upload
    that of a pre-image. Raises ParamRejected for a damaged sidecar."""
    if (sidecar := read_sidecar(file)) is not None:
        return sidecar.vehicle
    return _owner(file) if file.name.endswith(BEFORE) else ""


def accepted_values(receipts: Path, vehicle: str, system: int) -> dict[str, float]:
    """The values of `last_accepted`, by id; `vehicle` is the name in its file."""
    return {name: accepted.value for name, accepted in last_accepted(receipts, system, vehicle).items()}


@dataclass(frozen=True)
class InForce:
    """The model of a configuration that a vehicle was sent, as the files of its upload keep it.

    since: when the upload began, UTC text by this computer's clock; of a model that was sent again, the first one.
    path: its parameter file.
    """

    since: str
    path: Path
    sidecar: Sidecar


def model_in_force(
    receipts: Path, vehicle: str, configuration: str | None = None, at_utc: str = ""
) -> InForce | None:
    """The model of a vehicle's configuration, by the names in its file, that stood at a time; None if none did, or if
    its files can't be read.

    configuration: None for any. at_utc: UTC text, as in `bridge.clock.utc_text`; "" for now. Uploads and roll backs
    that were begun later do not count.
    """
    kept = [each for each in kept_in(receipts) if not at_utc or _utc(each.time) <= at_utc]
    newest: InForce | None = None
    for upload in reversed(_not_undone(kept)):
        path = path_of(upload.preimage, ACCEPTED)
        try:
            sidecar = read_sidecar(path)
        except ParamError:
            break
        if (
            sidecar is None
            or sidecar.vehicle != vehicle
            or configuration not in (None, sidecar.configuration)
        ):
            continue
        if newest is not None and sidecar != newest.sidecar:
            break
        newest = InForce(_utc(upload.time), path, sidecar)
    return newest


def ever_accepted(receipts: Path) -> list[Sidecar]:
    """The sidecars of all that vehicles accepted, rolled back since or not; those that can't be read are left out."""
    sidecars = []
    for kept in kept_in(receipts):
        with contextlib.suppress(ParamError):
            sidecars.append(read_sidecar(path_of(kept.preimage, ACCEPTED)))
    return [sidecar for sidecar in sidecars if sidecar is not None]


def kept_of(receipts: Path, vehicle: str, system: int | None = None) -> list[PastUpload]:
    """The receipts in a folder, by number, without those of other vehicles, by the name in their file; "" for all.
    `system` restricts them to a MAVLink system.

    A receipt that does not tell whose it is counts for every vehicle.
    """
    kept = kept_in(receipts, system)
    owners = _owners(kept)
    return [upload for upload in kept if _may_be_one(owners[upload.time], vehicle)]


def _owners(kept: Sequence[PastUpload]) -> dict[str, str]:
    """By the time of each upload the name of the vehicle that its values are of; "" if unknown."""
    owners: dict[str, str] = {}
    for upload in kept:
        back_to = Path(upload.restores).name.removesuffix(BEFORE)
        owners[upload.time] = owners.get(back_to, "") if upload.restores else _owner(upload.preimage)
    return owners


def _owner(preimage: Path) -> str:
    """Name of the vehicle that the values of an upload with that pre-image are of; "" if unknown."""
    for kind in (ACCEPTED, WANTED):
        with contextlib.suppress(ParamError):
            if (sidecar := read_sidecar(path_of(preimage, kind))) is not None:
                return sidecar.vehicle
    return ""


def _may_be_one(vehicle: str, other: str) -> bool:
    """Whether two names, "" if unknown, may be of one vehicle: two vehicles may have the same MAVLink address."""
    return not vehicle or not other or vehicle == other


def _utc(time: str) -> str:
    """`2026-11-20T091200Z`, or with a number, as in a file's name, -> `2026-11-20T09:12:00Z`."""
    return f"{time[:13]}:{time[13:15]}:{time[15:17]}Z"


def newest_before(receipts: Path, system: int) -> Path:
    """The pre-image for a roll back in one step: the values before the newest upload that wrote and was not rolled
    back, and before uploads with an unknown end (begun or unverified) that directly precede it.

    Raises ParamRejected if there is no such upload to that MAVLink system, or if those that stand there are of several
    vehicles by the names in their files: which of them is on the link, the address does not say.
    """
    standing = _not_undone(kept_in(receipts, system))
    owners = _owners(standing)
    names = sorted({*owners.values()} - {""}) or [""]
    before = {
        name: oldest.preimage
        for name in names
        if (oldest := _newest_of([each for each in standing if _may_be_one(owners[each.time], name)]))
    }
    if not before:
        raise ParamRejected(
            f"{receipts}: no upload to vehicle {system} that stands is kept there; give the -before.param to go back to"
        )
    if len(before) > 1:
        files = ", ".join(f"{path} for {name}" for name, path in before.items())
        raise ParamRejected(
            f"{receipts}: uploads to {len(before)} vehicles with the address {system} stand there; "
            f"give the file of the one on the link: {files}"
        )
    return next(iter(before.values()))


def _newest_of(standing: Sequence[PastUpload]) -> PastUpload | None:
    """Of a vehicle's uploads that stand, the one before whose values a roll back in one step goes back to."""
    oldest: PastUpload | None = None
    for kept in reversed(standing):
        if kept.outcome in _OPEN or (oldest is None and kept.outcome is Outcome.APPLIED):
            oldest = kept
        elif oldest is not None and kept.outcome is Outcome.APPLIED:
            break
    return oldest


def written_since(receipts: Path, system: int, preimage: Path) -> frozenset[str] | None:
    """Names of what a roll back to `preimage` takes back: written by its upload, or by a later one that stands.

    A later upload with an unknown end counts too, one of another vehicle by the name in its file does not. None if no
    receipt says so, neither in `receipts` nor in the folder of the file.
    """
    begun = kept_in(receipts, system)
    standing = _not_undone(begun)
    time = preimage.name.removesuffix(BEFORE)
    place = next((n for n, upload in enumerate(begun) if upload.time == time), None)
    if place is None:
        upload = receipt_of(preimage)
        return None if upload is None else upload.wrote
    owners = _owners(begun)
    later = (
        upload
        for upload in begun[place + 1 :]
        if (upload.outcome in _OPEN or (upload.outcome is Outcome.APPLIED and upload in standing))
        and _may_be_one(owners[upload.time], owners[time])
    )
    return begun[place].wrote.union(*(upload.wrote for upload in later))


def rolled_back(receipts: Path, system: int | None = None, vehicle: str = "") -> PastUpload | None:
    """The newest upload or roll back, if that is a roll back that was verified; else None. See `last_accepted`."""
    newest = next(reversed(kept_of(receipts, vehicle, system)), None)
    return newest if newest is not None and newest.restores and newest.outcome in _HELD else None


def _not_undone(begun: Sequence[PastUpload]) -> list[PastUpload]:
    """The uploads among receipts, in their order, that no later roll back of their vehicle has undone."""
    owners = _owners(begun)
    standing: list[PastUpload] = []
    for kept in begun:
        if not kept.restores:
            standing.append(kept)
        elif kept.outcome in _HELD:
            back_to = Path(kept.restores).name.removesuffix(BEFORE)
            place = next((n for n, upload in enumerate(begun) if upload.time == back_to), 0)
            taken = {
                upload.time
                for upload in begun[place:]
                if upload.system == kept.system and _may_be_one(owners[upload.time], owners[kept.time])
            }
            standing = [upload for upload in standing if upload.time not in taken]
    return standing
