"""`seatrial import`: list the contents of a recording, and make a dive folder from it."""

import argparse
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bridge import exit_codes
from bridge.arrays import Array
from bridge.command_line import interrupted_in_order
from bridge.errors import LogError
from bridge.files import replacing
from bridge.vehicle.config import VehicleFile, load_vehicle
from bridge.wire.tlog import SUFFIXES, read_tlog
from gcs_plugin.dives.folder import About, DiveFolder, about_vehicle
from gcs_plugin.fetch.merging import write_records
from identify.checks.mapping.first_mapping import mends
from identify.dive import Dive, Signal
from identify.gnss_fixes import check_fixes
from identify.ingest.files.streams import some_of
from identify.ingest.files.tables_of_one_dive import tables_of_one_dive
from identify.ingest.mapping.column_map import ColumnMap, column_map
from identify.ingest.mapping.names import is_position_z
from identify.ingest.mapping.proposal_of_runs import MOST_ASKED
from identify.ingest.open import BAG_FOLDER, MAPPED, read_dives, recording_files
from identify.ingest.ros.bags import ending_of
from identify.ingest.ros.definitions import files_beside
from identify.ingest.same_dive import identity_of
from identify.run.joined_runs import joined
from identify.run.recordings import read_each, runs_in
from tui import show
from tui.column_map import propose_map
from tui.files import Files
from tui.recordings import column_map_for

GAP_PERIODS = 5.0
SHORTEST_GAP_S = 0.5
DAMAGE_OUT = "What is damaged in it is left out."


def run(arguments: argparse.Namespace) -> int:
    if arguments.map is not None:
        return propose_map(arguments)
    file = load_vehicle(arguments.vehicle) if arguments.vehicle else None
    columns = column_map_for(arguments.columns, (arguments.file,))
    path = Path(arguments.file)
    places = runs_in(path)
    if len(places) > 1 and arguments.out:
        raise exit_codes.UsageError(
            f"--out: {path} holds {len(places)} recordings, and is a folder of runs as it is; leave it out, and give "
            "the folder and its column map to `identify --together` and `diagnose`"
        )
    if arguments.out and path.is_dir() and tables_of_one_dive(path):
        raise exit_codes.UsageError(
            f"--out: {path} holds a table a topic, known by their names, and is a dive folder as it is; leave it out, "
            "and keep the column map there as columns.yaml"
        )
    runs, left_out = read_each([path], lambda place: read_dives(place, columns, file))
    dive = _whole(runs, places, left_out)
    holds = contents(dive)
    console = show.results(arguments.json)
    show.put(
        console,
        show.Table(
            f"{dive.name}: {dive.duration_s:.1f} s",
            ("signal", "samples", "rate Hz", "gaps", "longest s", "unknown %"),
            [
                (s["name"], str(s["samples"]), show.number(s["rate_hz"], 3), str(s["gaps"]),
                 show.number(s["longest_gap_s"], 3), show.number(s["unknown_percent"], 2))
                for s in holds["signals"]
            ],
            numbers=("samples", "rate Hz", "gaps", "longest s", "unknown %"),
        ),
    )  # fmt: skip
    show.say(console, *(f"note: {note}" for note in dive.notes))
    if columns is not None:
        holds["contradictions"] = _contradictions(runs, column_map(columns))
        show.say(console, *(f"note: {sentence}" for sentence in holds["contradictions"]))
    fixes = check_fixes(dive)
    if fixes is not None:
        show.say(console, fixes.sentence)
        holds["fixes"] = fixes.sentence
    with Files() as files:
        if arguments.out:

            def file_it() -> None:
                made, words = dive_folder(Path(arguments.out), dive, columns, file)
                show.say(console, f"filed in {made}{words}")
                holds["folder"] = str(made)

            files.attempt(file_it)
        files.json(holds, arguments.json)
    return files.code(exit_codes.DONE)


def _whole(runs: Sequence[Dive], places: Sequence[Path], left_out: Mapping[str, str]) -> Dive:
    """The dive, or all runs as one, known by the table that holds them."""
    if len(runs) == 1 and not left_out:
        return runs[0]
    whole = joined(runs, left_out)
    return whole if len(places) > 1 else replace(whole, sha256=identity_of(recording_files(places[0])).sha256)


def _contradictions(runs: Sequence[Dive], columns: ColumnMap) -> list[str]:
    is_position = columns.depth is not None and any(map(is_position_z, filter(None, columns.depth.named)))
    showing: dict[tuple[str, str], list[str]] = {}
    sentences: dict[tuple[str, str], str] = {}
    for run in sorted(runs, key=lambda run: -run.duration_s)[:MOST_ASKED]:
        for mend in mends(run, depth_is_a_position=is_position):
            showing.setdefault((mend.signal, mend.remedy), []).append(run.name)
            sentences.setdefault((mend.signal, mend.remedy), mend.sentence)
    return [
        sentences[key] if len(runs) == 1 else f"{some_of(names)}: {sentences[key]}"
        for key, names in showing.items()
    ]


def dive_folder(out: Path, dive: Dive, columns: Path | None, file: VehicleFile | None) -> tuple[Path, str]:
    """Make a dive folder with a copy of the recording and of its column map; return it with remarks on the copy.

    Raises LogError if that fails, and then removes the folder again; also where a signal ends it.
    """
    if dive.source.is_dir() and not (dive.source / BAG_FOLDER).exists():
        raise exit_codes.UsageError(f"{dive.source}: is a dive folder already; import a file")
    notes = f"imported from {dive.source.name}, SHA-256 {dive.sha256}"
    about = about_vehicle(file, file.configuration or "", notes) if file else About(notes=notes)
    try:
        out.mkdir(parents=True)
    except FileExistsError:
        raise LogError(f"{out}: exists already and is never overwritten; name another folder") from None
    try:
        with interrupted_in_order():
            _copy(dive.source, out)
            if columns is not None:
                _copy_bytes(columns, out / "columns.yaml")
            DiveFolder(out).describe(about)
    except BaseException:
        # An incomplete folder would block the next import.
        shutil.rmtree(out, ignore_errors=True)
        raise
    return out, f". {DAMAGE_OUT}" if _is_tlog(dive.source) and dive.counts.get("skipped") else ""


def _is_tlog(path: Path) -> bool:
    return path.name.lower().endswith(SUFFIXES)


def _copy(source: Path, out: Path) -> None:
    """Copy the recording: the intact frames of a tlog, which are read without signing keys, of any other each file
    as it is."""
    if _is_tlog(source):
        frames = ((stamp_us, frame.raw) for stamp_us, frame in read_tlog(source))
        write_records(out / "telemetry.tlog", frames)
    else:
        for number, file in enumerate(recording_files(source), start=1):
            ending = next((ending for ending in MAPPED if file.name.lower().endswith(ending)), file.suffix)
            _copy_bytes(file, out / f"telemetry{f'.{number}' if number > 1 else ''}{ending}")
            for defined in files_beside(file) if ending_of(file) else ():
                made = out / defined.relative_to(defined.parents[2])
                made.parent.mkdir(parents=True, exist_ok=True)
                _copy_bytes(defined, made)


def _copy_bytes(source: Path, made: Path) -> None:
    """Copy the bytes to disk. Raises LogError naming the copy, since the source was read in full just before."""
    with source.open("rb") as read, replacing(made, "import again") as written:
        shutil.copyfileobj(read, written)


def contents(dive: Dive) -> dict[str, Any]:
    return {
        "name": dive.name,
        "sha256": dive.sha256,
        "duration_s": dive.duration_s,
        "signals": [_signal(name, signal, dive.breaks_s) for name, signal in dive.signals().items()],
        "counts": dive.counts,
        "notes": list(dive.notes),
    }


def _signal(name: str, signal: Signal, breaks_s: Array) -> dict[str, Any]:
    """A signal's samples, rate and gaps; between two runs there is no gap, and an axis never read is not unknown."""
    in_a_run = np.diff(np.searchsorted(breaks_s, signal.time_s)) == 0
    steps = np.diff(signal.time_s)[in_a_run]
    hz = signal.counted_hz
    usual = 1.0 / hz if hz else 0.0
    gaps = steps[steps > max(GAP_PERIODS * usual, SHORTEST_GAP_S)]
    known = np.isfinite(signal.value)
    unknown = ~known[:, known.any(axis=0)].all(axis=1)
    return {
        "name": name,
        "samples": len(signal),
        "rate_hz": hz,
        "gaps": len(gaps),
        "longest_gap_s": float(gaps.max(initial=0.0)),
        "unknown_percent": 100.0 * float(unknown.mean()) if len(signal) else 0.0,
    }
