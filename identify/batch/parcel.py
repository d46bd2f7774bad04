"""Packs a job as bytes, with its recording, vehicle file and tables, for a computer that does not see our disk."""

import tempfile
import zlib
from dataclasses import dataclass, replace
from pathlib import Path

from bridge.vehicle.config import VehicleFile
from identify.batch.jobs import Job, Result, own_columns, run_job, thrust_table
from identify.batch.threads import one_thread
from identify.batch.version import our_version

DIVE, VEHICLE, COLUMNS = Path("dive"), Path("vehicle"), Path("columns")
FAST = 1
"""Compression level of zlib: a recording shrinks by a third in a quarter of a second."""


@dataclass(frozen=True)
class Item:
    """A file: its name here, its path within the receiver's temporary folder, and its compressed bytes."""

    name: str
    place: Path
    data: bytes


@dataclass(frozen=True)
class Parcel:
    """A packed job. Paths in `job` are relative to the folder that the items are unpacked into."""

    job: Job
    source: str
    version: str
    items: tuple[Item, ...]


def pack(job: Job) -> Parcel:
    """Pack a job with every file that it reads. Raises OSError if a file is gone."""
    recording, vehicle, table = job.recording, job.vehicle, thrust_table(job.vehicle)
    root = DIVE / recording.path.resolve().name
    is_folder = recording.path.is_dir()
    places = {file: root / file.name if is_folder else root for file in recording.files}
    places[vehicle.path] = VEHICLE / vehicle.path.name
    if (columns := own_columns(recording)) is not None:
        places[columns] = root / columns.name
    if job.columns is not None:
        places[job.columns] = COLUMNS / job.columns.name
    if table is not None:
        places[table] = VEHICLE / table.name
        vehicle = _with_table(vehicle, table.name)
    files = tuple(places[file] for file in recording.files)
    sent = replace(
        job,
        recording=replace(recording, path=root, files=files),
        vehicle=replace(vehicle, path=places[vehicle.path]),
        columns=places[job.columns] if job.columns else None,
    )
    items = tuple(
        Item(str(file), place, zlib.compress(file.read_bytes(), FAST)) for file, place in places.items()
    )
    return Parcel(sent, str(recording.path), our_version(), items)


def unpack(parcel: Parcel, folder: Path) -> Job:
    """Write the files below `folder` and return the job with their paths."""
    for item in parcel.items:
        path = folder / item.place
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(zlib.decompress(item.data))
    job = parcel.job
    recording = replace(
        job.recording,
        path=folder / job.recording.path,
        files=tuple(folder / file for file in job.recording.files),
    )
    return replace(
        job,
        recording=recording,
        vehicle=replace(job.vehicle, path=folder / job.vehicle.path),
        columns=folder / job.columns if job.columns else None,
    )


def run_parcel(parcel: Parcel) -> Result:
    """Unpack a job, run it and delete its files. Errors name the files by the sender's paths.

    Fails if the worker's version of seatrial differs from the sender's.
    """
    if our_version() != parcel.version:
        return parcel.job.failed(
            f"its worker has seatrial {our_version()}, the sender has {parcel.version}; install the same on both",
            final=False,
        )
    one_thread()
    with tempfile.TemporaryDirectory(prefix="seatrial-") as place:
        folder = Path(place)
        result = run_job(unpack(parcel, folder))
        error = result.error
        for item in parcel.items:
            error = error.replace(str(folder / item.place), item.name)
        return replace(result, error=error.replace(str(folder / parcel.job.recording.path), parcel.source))


def _with_table(file: VehicleFile, name: str) -> VehicleFile:
    curve = replace(file.vehicle.thrust_curve, file=name)
    return replace(file, vehicle=replace(file.vehicle, thrust_curve=curve))
