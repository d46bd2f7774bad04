"""Reads any recording as a Dive: a dive folder, `.tlog`, `.tlog.gz`, DataFlash `.BIN`, `.csv` with its column map."""

import hashlib
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from bridge.clock import OLDEST_UNIX_S, date_in_name
from bridge.errors import LogError
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.thrusters import NEUTRAL_US
from bridge.wire import tlog
from bridge.wire.tlog import load_bytes
from bridge.wire.whole import lacked, lacked_words, standing_for
from identify.checks.frozen import without_frozen
from identify.checks.gaps import gaps
from identify.checks.impossible import without_impossible, without_repeated
from identify.dive import Dive, Kind, Note
from identify.ingest.commands import with_known_commands, with_spread_commands
from identify.ingest.dataflash import read_dataflash
from identify.ingest.effort import with_pulses
from identify.ingest.logs import logs_beside, with_logs
from identify.ingest.table import column_map, read_table
from identify.ingest.tlog import read_tlog

LONGEST_DIVE_S = 30 * 86_400.0
"""Later steps allocate by the seconds of a dive, so that an impossible time would fill the memory."""
HEARD = (".tlog", ".tlog.gz")
TABLES = (".csv", ".csv.gz", ".txt", ".tsv")
FORMS = "give a dive folder, a .tlog, a .tlog.gz, a .BIN or a .csv"


def read_dive(path: Path, columns: Path | None = None, vehicle: VehicleFile | None = None) -> Dive:
    """The dive in a recording, without impossible or frozen readings, and with notes on what it lacks.

    `columns` is the column map of a `.csv`, a file or the bare name of a map in configs/columns; a dive folder made
    from a `.csv` holds its own, `columns.yaml`. With `vehicle`, the notes also say whether the recording fits the
    vehicle. Raises LogError with a sentence if nothing can be read; ConfigError for an invalid column map.
    """
    files = recording_files(path)
    folder_map = path / "columns.yaml"
    columns = folder_map if columns is None and folder_map.exists() else columns
    fields, known_by = _fields(files, columns, str(path)), identity_of(files)
    recorded = Dive(_name(path), path, known_by.sha256, opening=known_by.opening, **fields)
    start_s, end_s = recorded.span_s
    if not end_s - start_s <= LONGEST_DIVE_S:
        raise LogError(
            f"{path}: its times lie {(end_s - start_s) / 86_400:.3g} days apart, and a dive is no longer than "
            f"{LONGEST_DIVE_S / 86_400:.0f}; mend its times, or cut out the dive"
        )
    piloted = recorded if vehicle is None else with_pulses(recorded, vehicle)
    possible = with_known_commands(with_spread_commands(without_impossible(piloted)), _thrusters(vehicle))
    rest_us = NEUTRAL_US if vehicle is None else vehicle.vehicle.thrust_curve.neutral_us
    dive = without_frozen(without_repeated(possible), rest_us)
    return replace(dive, notes=(*_unread(path), *dive.notes, *gaps(dive), *_misfits(dive, vehicle)))


def recording_files(path: Path) -> list[Path]:
    """The files of a recording.

    For a file, the file itself. For a dive folder, the completed recording if there is one, otherwise all parts in
    the order in which the recorder began them; then the autopilot's logs in the folder.

    Raises LogError.
    """
    if not path.exists():
        raise LogError(f"{path}: no such file or folder; check the name")
    if not path.is_dir():
        return [path]
    recordings = sorted(file for file in path.iterdir() if file.name.endswith(HEARD))
    ours = _ours(recordings)
    chosen = standing_for(ours) or recordings
    if len(chosen) > 1 and chosen is recordings:
        names = ", ".join(file.name for file in recordings)
        raise LogError(f"{path}: holds several recordings ({names}); name one of them")
    if ours:
        return [*chosen, *logs_beside(path)]
    chosen = chosen or [
        file for file in path.glob("telemetry.*") if file.name.lower().endswith((".bin", *TABLES))
    ]
    if not chosen:
        raise LogError(f"{path}: holds no recording; {FORMS}")
    return chosen


def _unread(path: Path) -> tuple[str, ...]:
    """Describe what a dive folder's own recordings hold that the completed recording, which is read, lacks."""
    if not path.is_dir():
        return ()
    words = lacked_words(path, lacked(_ours(path.iterdir())))
    return (Note(words, Kind.LACKING),) if words else ()


def _ours(paths: Iterable[Path]) -> list[Path]:
    return sorted(
        (file for file in paths if file.name.startswith("telemetry") and file.name.endswith(HEARD)),
        key=_number,
    )


def _number(file: Path) -> int:
    """1 for `telemetry.tlog`, 2 for `telemetry.2.tlog`, which the recorder began next."""
    digits = re.search(r"\d+", file.name)
    return int(digits.group()) if digits else 1


def _fields(files: Sequence[Path], columns: Path | None, source: str) -> dict[str, Any]:
    name = files[0].name.lower()
    if name.endswith(HEARD):
        heard = [file for file in files if not file.name.lower().endswith(".bin")]
        return with_logs(read_tlog(heard, source), heard, files[len(heard) :])
    if name.endswith(".bin"):
        return read_dataflash(files[0])[0]
    if name.endswith(TABLES):
        if columns is None:
            raise LogError(
                f"{source}: a table needs a column map; give one with --columns FILE, or make one with "
                "`seatrial import FILE --map`"
            )
        return read_table(files[0], column_map(columns))
    raise LogError(f"{source}: can't tell what this is by its ending; {FORMS}")


def _name(path: Path) -> str:
    name = path.resolve().name
    for ending in (".gz", ".tlog", ".BIN", ".bin", ".csv", ".txt", ".tsv"):
        name = name.removesuffix(ending)
    return name


def _thrusters(vehicle: VehicleFile | None) -> int | None:
    """Largest number of thruster outputs of any configuration; None, meaning all outputs, if unknown."""
    if vehicle is None:
        return None
    return max(len(c.thrusters) for c in vehicle.vehicle.configurations.values()) or None


def _misfits(dive: Dive, vehicle: VehicleFile | None) -> tuple[str, ...]:
    if vehicle is None or dive.thruster_commands is None:
        return ()
    outputs = dive.thruster_commands.value.shape[1]
    fewest = min(len(c.thrusters) for c in vehicle.vehicle.configurations.values())
    if outputs < fewest:
        return (
            f"The recording has {outputs} thruster outputs, vehicle '{vehicle.vehicle.name}' has {fewest} "
            "thrusters: check that this is its recording.",
        )
    return ()


OPENING_BYTES = 1 << 16
"""Some seconds of telemetry: hundreds of microsecond stamps and noisy readings, which no other dive repeats."""

SAME, PIECE, OVERLAPPING = "holds the same recording as", "is a piece of", "shares a stretch with"
"""Relations between two recordings of the same dive, worded to stand between their names."""


@dataclass(frozen=True)
class Identity:
    """`sha256` of all `size_bytes`; `opening`: SHA-256 of the first OPENING_BYTES, to recognise a copy that was cut.

    `opening` is empty if the recording is shorter, and for formats in which two dives can begin alike: a table, or a
    DataFlash log, which opens with its own formats.
    """

    sha256: str
    opening: str
    size_bytes: int


def identity_of(files: Sequence[Path]) -> Identity:
    """Identity of the recording in these files, concatenated. Raises LogError if a file can't be read."""
    data = contents(files)
    has_opening = _is_tlog(files) and len(data) >= OPENING_BYTES
    opening = hashlib.sha256(data[:OPENING_BYTES]).hexdigest() if has_opening else ""
    return Identity(hashlib.sha256(data).hexdigest(), opening, len(data))


def contents(files: Sequence[Path]) -> bytes:
    """Uncompressed bytes of a recording's files, concatenated. Raises LogError."""
    return b"".join(load_bytes(file)[0] for file in files)


def of_one_dive(files: Sequence[Path], others: Sequence[Path]) -> str:
    """How the recording in `files` overlaps with the dive in `others`, in words; "" if it does not.

    In any format, a recording whose bytes are contained in the other is recognised. Two `.tlog` that only overlap are
    recognised if the other holds the opening of one of them; other formats open with bytes that every dive of theirs
    has. Raises LogError if a file can't be read.
    """
    data, other_data = contents(files), contents(others)
    if data == other_data:
        return SAME
    if not (data and other_data):
        return ""
    short, long = sorted((data, other_data), key=len)
    if short in long:
        return PIECE if short is data else OVERLAPPING
    comparable = _is_tlog(files) and _is_tlog(others) and len(short) >= OPENING_BYTES
    return (
        OVERLAPPING
        if comparable and (data[:OPENING_BYTES] in other_data or other_data[:OPENING_BYTES] in data)
        else ""
    )


def _is_tlog(files: Sequence[Path]) -> bool:
    return files[0].name.lower().endswith(HEARD)


def date_of(dive: Dive) -> tuple[float | None, str]:
    """Unix time of the first sample and its source, in words; None and an empty string if nothing gives the time.

    The vehicle's own SYSTEM_TIME takes precedence over the recorder's stamps, and these over a date in the name.
    """
    if dive.unix_at_boot_s is not None:
        return dive.unix_at_boot_s + dive.span_s[0], "the vehicle's clock"
    stamp_s = _first_stamp_s(recording_files(dive.source)[0])
    if stamp_s is not None:
        return stamp_s, "the recorder's clock"
    named_s = date_in_name(dive.name)
    return named_s, "" if named_s is None else "its name"


def utc(unix_s: float | None) -> str:
    """`2026-11-20 09:12`; a dash for a dive without a date."""
    return "-" if unix_s is None else f"{datetime.fromtimestamp(unix_s, UTC):%Y-%m-%d %H:%M}"


def _first_stamp_s(file: Path) -> float | None:
    if not file.name.endswith(HEARD):
        return None
    first = next(iter(tlog.read_tlog(file)), None)
    return first[0] * 1e-6 if first is not None and first[0] * 1e-6 > OLDEST_UNIX_S else None
