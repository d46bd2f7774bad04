"""Reads any recording as a Dive: a dive folder, `.tlog`, `.tlog.gz`, DataFlash `.BIN`, or with a column map a table, a
bag of ROS, a `.ulg`, `.mat`, `.npz` or JSON lines.
"""

import re
from collections.abc import Callable, Iterable, Sequence, Set
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bridge.clock import OLDEST_UNIX_S, date_in_name
from bridge.errors import LogError
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.thrusters import NEUTRAL_US
from bridge.wire import tlog
from bridge.wire.tlog import SUFFIXES
from bridge.wire.whole_recording import files_to_read, number, unmerged_words, with_unmerged_frames
from identify.checks.readings.copies import without_copies
from identify.checks.readings.frozen import without_frozen
from identify.checks.readings.impossible import refuse_years, without_impossible, without_repeated
from identify.checks.readings.missing_signals import missing_signals
from identify.checks.readings.smoothed_gyro import without_smoothed_gyro
from identify.checks.readings.still_gyro import without_still_gyro
from identify.dive import Dive, Kind, Note, Signal
from identify.ingest.commands import with_known_commands, with_pulses, with_spread_commands
from identify.ingest.files.arrays import read_npz
from identify.ingest.files.json_lines import read_json_lines
from identify.ingest.files.matlab import read_matlab
from identify.ingest.files.parquet import read_parquet
from identify.ingest.files.run_column import split_streams
from identify.ingest.files.sentinels import without_sentinels
from identify.ingest.files.split_stamps import with_whole_stamps
from identify.ingest.files.streams import Streams, some_of
from identify.ingest.files.tables_of_one_dive import read_tables, tables_of_one_dive
from identify.ingest.files.text_table import TABLES, read_table
from identify.ingest.files.ulog import read_ulog
from identify.ingest.lever_arm import at_transducer
from identify.ingest.mapping.column_map import ColumnMap, RunColumn, column_map
from identify.ingest.mapping.signals import dive_fields
from identify.ingest.mavlink.autopilot_log import logs_beside, with_logs
from identify.ingest.mavlink.dataflash import read_dataflash
from identify.ingest.mavlink.heading_resets import without_heading_resets
from identify.ingest.mavlink.tlog import read_tlog
from identify.ingest.ros.bags import READERS as BAGS
from identify.ingest.ros.bags import bag_files, read_bag
from identify.ingest.ros.bags import ending_of as bag_ending
from identify.ingest.same_dive import hash_of, identity_of
from identify.ingest.slow_pulses import with_reckoned_pulses
from identify.words import listed

FILES: dict[str, Callable[[Path], Streams]] = {
    **dict.fromkeys(TABLES, read_table),
    ".parquet": read_parquet,
    ".mat": read_matlab,
    ".npz": read_npz,
    ".ulg": read_ulog,
    ".jsonl": read_json_lines,
    ".ndjson": read_json_lines,
}
"""Readers of the files that need a column map, by ending."""
MAPPED = (*FILES, *BAGS)
"""Endings of all recordings that need a column map; a ROS 2 bag may also be a folder of its parts."""
BAG_FOLDER = "metadata.yaml"
_PART = re.compile(r"_\d+$")
"""Ends the names of the parts of a ROS 2 bag, whose metadata.yaml is missing where its recorder was killed."""
FORMS = (
    "give a dive folder, a .tlog, a .tlog.gz, a .BIN, or with --columns a .csv, .csv.gz, .txt, .tsv, .parquet, .mat, "
    ".npz, .ulg, .jsonl, .ndjson, .bag, .bag.active, .mcap, .db3, .mcap.zstd, .db3.zstd or the folder of a ROS 2 bag"
)


def read_dive(path: Path, columns: Path | None = None, vehicle: VehicleFile | None = None) -> Dive:
    """The dive in a recording, as `read_dives`. Raises LogError if it holds several runs, too."""
    dives = read_dives(path, columns, vehicle)
    if len(dives) > 1:
        raise LogError(
            f"holds {len(dives)} runs by its column map, from {dives[0].name} to {dives[-1].name}, and no "
            "single dive; `identify --together` and `diagnose` take them as runs of one",
            path,
        )
    return dives[0]


def read_dives(
    path: Path, columns: Path | None = None, vehicle: VehicleFile | None = None
) -> tuple[Dive, ...]:
    """The dive in a recording, or each run of a table that holds several (`ColumnMap.runs`), without impossible or
    frozen readings, and with notes on what it lacks.

    `columns` is the column map of a recording that needs one (MAPPED), a file or the bare name of a map in
    configs/columns; a dive folder made from such a recording holds its own, `columns.yaml`. With `vehicle`, the notes
    also say whether the recording fits the vehicle. Raises LogError with a sentence if nothing can be read; ConfigError
    for an invalid column map.
    """
    files = recording_files(path)
    folder_map = path / "columns.yaml"
    columns = folder_map if columns is None and folder_map.exists() else columns
    if (mapped := _mapped(files, columns, str(path))) is not None and mapped.runs is not None:
        return _dives_of_runs(path, files, mapped, mapped.runs, vehicle)
    known_by = identity_of(files)
    fields = _fields(files, mapped, str(path))
    recorded = Dive(_name(path), path, known_by.sha256, opening=known_by.opening, **fields)
    return (_checked(recorded, vehicle),)


def _checked(recorded: Dive, vehicle: VehicleFile | None) -> Dive:
    """A dive as recorded, without impossible or frozen readings, and with notes. Raises LogError."""
    refuse_years(recorded.span_s, recorded.source)
    once = without_copies(recorded)
    placed = once if vehicle is None else at_transducer(once, vehicle.vehicle.sensors)
    piloted = placed if vehicle is None else with_pulses(placed, vehicle)
    possible = with_known_commands(with_spread_commands(without_impossible(piloted)), _thrusters(vehicle))
    possible = with_reckoned_pulses(possible, vehicle, _thrusters(vehicle))
    rest_us = NEUTRAL_US if vehicle is None else vehicle.vehicle.thrust_curve.neutral_us
    moving = without_still_gyro(without_frozen(without_repeated(possible), rest_us, _thrusters(vehicle)))
    dive = without_smoothed_gyro(without_heading_resets(moving))
    return replace(
        dive, notes=(*_unread(recorded.source), *dive.notes, *missing_signals(dive), *_misfits(dive, vehicle))
    )


def recording_files(path: Path) -> list[Path]:
    """The files of a recording.

    For a file, the file itself. For a dive folder, the completed recording if there is one, otherwise all parts in
    the order in which the recorder began them; then the autopilot's logs in the folder. For a folder with a table a
    topic, these.

    Raises LogError.
    """
    if not path.exists():
        raise LogError("no such file or folder; check the name", path)
    if not path.is_dir():
        return [path]
    recordings = sorted(file for file in path.iterdir() if file.name.lower().endswith(SUFFIXES))
    ours = _ours(recordings)
    chosen = files_to_read(ours) or recordings
    if len(chosen) > 1 and chosen is recordings:
        names = ", ".join(file.name for file in recordings)
        raise LogError(f"holds several recordings ({names}); name one of them", path)
    if ours:
        return [*chosen, *logs_beside(path)]
    chosen = chosen or _imported(path) or tables_of_one_dive(path)
    if not chosen:
        raise LogError(_of_several(path) or f"holds no recording; {FORMS}", path)
    return chosen


def _of_several(folder: Path) -> str:
    """Fault of a folder of recordings that is given for a single one; "" if it holds none."""
    names = sorted(file.name for file in folder.iterdir() if file.name.lower().endswith((".bin", *MAPPED)))
    if not names:
        return ""
    return (
        f"is no dive folder, but holds {some_of(names)}; name one of them, and its column map serves all that have the "
        "same columns; `identify --together` and `diagnose` take a folder of runs"
    )


def _imported(folder: Path) -> list[Path]:
    """The recording of another program that a dive folder holds a copy of, or the parts of a ROS 2 bag."""
    copies = [file for file in folder.glob("telemetry.*") if file.name.lower().endswith((".bin", *MAPPED))]
    files = sorted(copies, key=number) or list(bag_files(folder))
    if not files and (folder / BAG_FOLDER).exists():
        raise LogError("is the folder of a ROS 2 bag without a .db3 or .mcap; copy these into it", folder)
    endings = {bag_ending(file) for file in files}
    bags = {_PART.sub("", file.name.lower().removesuffix(bag_ending(file))) for file in files}
    if len(files) > 1 and not (len(endings) == 1 and endings <= BAGS.keys() and (copies or len(bags) == 1)):
        names = ", ".join(file.name for file in files)
        raise LogError(f"holds several recordings ({names}); name one of them", folder)
    return files


def _unread(path: Path) -> tuple[str, ...]:
    """Describe what a dive folder's own recordings hold that the completed recording, which is read, lacks."""
    if not path.is_dir():
        return ()
    words = unmerged_words(path, with_unmerged_frames(_ours(path.iterdir())))
    return (Note(words, Kind.LACKING),) if words else ()


def _ours(paths: Iterable[Path]) -> list[Path]:
    return sorted(
        (
            file
            for file in paths
            if file.name.startswith("telemetry") and file.name.lower().endswith(SUFFIXES)
        ),
        key=number,
    )


def _mapped(files: Sequence[Path], columns: Path | None, source: str) -> ColumnMap | None:
    """The column map of a recording that needs one. Raises LogError if none is given, ConfigError if it is invalid."""
    if not files[0].name.lower().endswith(MAPPED):
        return None
    if columns is None:
        raise LogError(
            f"a {_ending(files[0])} needs a column map; give one with --columns FILE, or make one with "
            "`seatrial import FILE --map`",
            source,
        )
    return column_map(columns)


def _dives_of_runs(
    path: Path, files: Sequence[Path], columns: ColumnMap, by: RunColumn, vehicle: VehicleFile | None
) -> tuple[Dive, ...]:
    """The runs of a table, each as a dive; those that can't be read are left out, and noted with the first.

    Raises LogError if most of them can't.
    """
    whole = identity_of(files).sha256
    dives, unread = list[Dive](), dict[str, LogError]()
    for run, rows in split_streams(_streams(files, columns.names), by, files[0]):
        try:
            fields = _since_start(dive_fields(rows, columns, files[0]))
            sha256 = hash_of(f"{whole} {run}".encode())
            dives.append(_checked(Dive(f"{_name(path)} run {run}", path, sha256, **fields), vehicle))
        except LogError as error:
            unread[run] = error
    if len(unread) >= max(len(dives), 1):
        raise next(iter(unread.values()))
    notes = [f"Run {run} was left out: {error}." for run, error in unread.items()]
    return (replace(dives[0], notes=(*dives[0].notes, *notes)), *dives[1:])


def _fields(files: Sequence[Path], columns: ColumnMap | None, source: str) -> dict[str, Any]:
    name = files[0].name.lower()
    if name.endswith(SUFFIXES):
        heard = [file for file in files if not file.name.lower().endswith(".bin")]
        return with_logs(read_tlog(heard, source), heard, files[len(heard) :])
    if name.endswith(".bin"):
        return read_dataflash(files[0])[0]
    if columns is not None:
        fields = dive_fields(_streams(files, columns.names), columns, files[0])
        return fields if name.endswith(TABLES) else _since_start(fields)
    raise LogError(_strange(source))


def _strange(source: str) -> str:
    return f"{source}: can't tell what this is by its ending; {FORMS}"


def read_streams(path: Path) -> Streams:
    """What a recording that needs a column map holds. Raises LogError."""
    files = recording_files(path)
    name = files[0].name.lower()
    if name.endswith((*SUFFIXES, ".bin")):
        raise LogError("needs no column map; leave it out", path)
    if not name.endswith(MAPPED):
        raise LogError(_strange(str(path)))
    return _streams(files)


def _streams(files: Sequence[Path], used: Set[str] | None = None) -> Streams:
    """The contents of the files, and in the columns `used`, or in all, no number that stands for no reading.

    Raises LogError.
    """
    held = [file for file in files if not (file.is_file() and file.stat().st_size == 0)]
    if not held:
        raise LogError(
            "is empty, nothing was recorded in it; copy it again, or give another recording", files[0]
        )
    ending = _ending(held[0])
    if ending in BAGS:
        streams = read_bag(held)
    else:
        streams = with_whole_stamps(FILES[ending](held[0]) if len(held) == 1 else read_tables(held))
    notes = tuple(f"{file.name} is empty: nothing was recorded in it." for file in files if file not in held)
    return without_sentinels(replace(streams, notes=(*streams.notes, *notes)), used)


def _ending(file: Path) -> str:
    """The ending of a file that needs a column map."""
    return next(ending for ending in MAPPED if file.name.lower().endswith(ending))


def _since_start(fields: dict[str, Any]) -> dict[str, Any]:
    """The fields of a Dive, Unix times counted from a whole second at its start, so that they keep their precision."""
    signals = {name: held for name, held in fields.items() if isinstance(held, Signal)}
    start_s = min((float(held.time_s[0]) for held in signals.values() if len(held)), default=0.0)
    if start_s < OLDEST_UNIX_S:
        return fields
    origin_s = float(np.floor(start_s))
    counted = {name: Signal(held.time_s - origin_s, held.value) for name, held in signals.items()}
    return {**fields, **counted, "unix_at_boot_s": origin_s}


def _name(path: Path) -> str:
    name = path.resolve().name
    for ending in (".gz", ".tlog", ".bin", *MAPPED):
        name = name[: -len(ending)] if name.lower().endswith(ending) else name
    return name


def _thrusters(vehicle: VehicleFile | None) -> int | None:
    """Largest number of thruster outputs of any configuration; None, meaning all outputs, if unknown."""
    if vehicle is None:
        return None
    return max(len(c.thrusters) for c in vehicle.vehicle.configurations.values()) or None


def _misfits(dive: Dive, vehicle: VehicleFile | None) -> tuple[str, ...]:
    """A sentence on a vehicle file that fits the outputs badly. Raises LogError for a file of another frame."""
    if vehicle is None or dive.thruster_commands is None:
        return ()
    counts = sorted({len(shape.thrusters) for shape in vehicle.vehicle.configurations.values()})
    if dive.motors and dive.motors not in counts:
        raise LogError(
            f"its autopilot drives {dive.motors} motors (FRAME_CONFIG), and vehicle "
            f"'{vehicle.vehicle.name}' has {listed([str(count) for count in counts])} thrusters; give the file of the "
            "vehicle that was dived: `seatrial vehicle guess` proposes one for a log",
            dive.source,
        )
    outputs = dive.thruster_commands.value.shape[1]
    fewest = min(len(c.thrusters) for c in vehicle.vehicle.configurations.values())
    if outputs < fewest:
        return (
            f"The recording has {outputs} thruster outputs, vehicle '{vehicle.vehicle.name}' has {fewest} "
            "thrusters: check that this is its recording.",
        )
    return ()


def date_of(dive: Dive) -> tuple[float | None, str]:
    """Unix time of the first sample and its source, in words; None and an empty string if nothing gives the time.

    SYSTEM_TIME takes precedence over the stamps of the recorder, these over times since 1970, and these over
    a date in the name.
    """
    if dive.unix_at_boot_s is not None:
        return dive.unix_at_boot_s + dive.span_s[0], "the vehicle's clock"
    stamp_s = _first_stamp_s(recording_files(dive.source)[0])
    if stamp_s is not None:
        return stamp_s, "the recorder's clock"
    if dive.span_s[0] > OLDEST_UNIX_S:
        return dive.span_s[0], "its own times"
    named_s = date_in_name(dive.name)
    return named_s, "" if named_s is None else "its name"


def _first_stamp_s(file: Path) -> float | None:
    if not file.name.lower().endswith(SUFFIXES):
        return None
    first = next(iter(tlog.read_tlog(file)), None)
    return first[0] * 1e-6 if first is not None and first[0] * 1e-6 > OLDEST_UNIX_S else None
