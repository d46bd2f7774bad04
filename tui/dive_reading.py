"""Reads dives for the list of them, with a cache in each dive's folder.

An entry is renewed if the recording, the vehicle file or this program has changed.
"""

import contextlib
import math
from collections.abc import Callable, Iterator
from dataclasses import asdict, replace
from functools import cache
from pathlib import Path
from typing import Any, Final

from bridge.errors import ConfigError, LogError, SeatrialError
from bridge.files import read_small, write_whole
from bridge.plain import from_json, to_json
from bridge.text import printable
from bridge.vehicle.config import VehicleFile, load_vehicle
from bridge.wire.tlog import SUFFIXES
from gcs_plugin.dives.folder import About, DiveFolder, vehicle_named
from gcs_plugin.dives.recordings import GLANCE, began, order, recordings
from gcs_plugin.locks import is_being_written
from identify.axis_span import Span
from identify.dive import Dive, Kind
from identify.estimators.excitation import excitation, spans
from identify.ingest.mavlink.message_loss import Loss, loss_of
from identify.ingest.open import date_of, read_dive, recording_files
from identify.run.recordings import stray_bytes
from tui.dive_list import VERSION, DiveRow, Glance, dive_folders, kept, short_name, state_of

NOTHING_YET: Final = "is being recorded, nothing heard yet"
Load = Callable[[str], VehicleFile]


def row_of(
    folder: Path, named: VehicleFile | None = None, otherwise: str = "", load: Load = load_vehicle
) -> DiveRow:
    """Read a dive and judge it by the vehicle file `named`, else by that in `dive.yaml`, else by `otherwise`."""
    about, damaged, vehicle, trouble = About(), "", named, ""
    try:
        about = DiveFolder(folder).about()
    except ConfigError as error:
        damaged = str(error)
    try:
        if vehicle is None and (file := vehicle_named(about, otherwise)):
            vehicle = load(file)
    except ConfigError as error:
        trouble = str(error)
    files = _recordings(folder)
    key = _key(folder, files, vehicle)
    glance = kept(folder, key)
    if glance is None:
        glance = _looked(folder, vehicle)
        _keep(folder, key, glance)
    if trouble:
        glance = replace(glance, why_not=trouble)
    size = sum(size for _, size, _ in key["recordings"])
    underway = ""
    if glance.error and not size and any(is_being_written(file) for file in recordings(folder)):
        glance, underway = replace(glance, error=""), NOTHING_YET
    results = list(_results(folder))
    events = tuple(f"{event.utc} {event.text}" for event in about.events)
    return DiveRow(
        folder,
        printable(short_name(folder), "?"),
        size,
        glance,
        about.notes,
        events,
        tuple(sentence for _, sentence in results),
        tuple(dict.fromkeys(kind for kind, _ in results if kind)),
        about.conditions.words,
        damaged,
        underway,
    )


def rows_of(
    root: Path,
    named: VehicleFile | None,
    otherwise: str = "",
    progress: Callable[[float, str], None] = lambda *_: None,
) -> list[DiveRow]:
    """The dives in a folder, the oldest first."""
    folders = dive_folders(root)
    rows, load = [], cache(load_vehicle)
    for number, folder in enumerate(folders):
        progress(number / len(folders), f"look at {folder.name}")
        rows.append(row_of(folder, named, otherwise, load))
    return sorted(rows, key=lambda row: order(row.folder))  # some dates are known only now


def _recordings(folder: Path) -> list[Path]:
    try:
        return recording_files(folder)
    except LogError:
        return []


def _looked(folder: Path, vehicle: VehicleFile | None) -> Glance:
    columns = folder / "columns.yaml"
    # Reading a pipe would block forever.
    not_a_file = next((file for file in recordings(folder) if file.exists() and not file.is_file()), None)
    if not_a_file is not None:
        return Glance(began_unix_s=began(folder), error=f"{not_a_file}: is no file; take it away")
    try:
        dive = read_dive(folder, columns if columns.exists() else None, vehicle)
    except SeatrialError as error:
        return Glance(began_unix_s=began(folder), error=str(error))
    relative_std, why_not = _excitation(dive, vehicle)
    loss = _loss(folder)
    return Glance(
        began_unix_s=date_of(dive)[0],
        duration_s=dive.duration_s,
        loss=math.nan if loss is None else loss.share,
        relative_std=relative_std,
        spans=_spans(dive, vehicle),
        why_not=why_not,
        stray=stray_bytes(folder),
        restarts=dive.note_of(Kind.RESTART),
        lacking=dive.note_of(Kind.LACKING),
        unheard_s=0.0 if loss is None else loss.unheard_s,
        unheard="" if loss is None else loss.note,
    )


def _loss(folder: Path) -> Loss | None:
    """Loss in the recordings; None if no sequence numbers are recorded."""
    files = [file for file in _recordings(folder) if file.name.endswith(SUFFIXES)]
    unread = [file for file in recordings(folder) if file not in files]
    return loss_of(files, str(folder), unread) if files else None


def _excitation(dive: Dive, vehicle: VehicleFile | None) -> tuple[dict[str, float] | None, str]:
    if vehicle is None:
        return None, "no vehicle file is known; give one with --vehicle"
    try:
        result = excitation(dive, vehicle, vehicle.configuration_of(dive.configuration_index()))
    except SeatrialError as error:
        return None, str(error)
    return {coefficient.name: coefficient.relative_std for coefficient in result.coefficients}, result.note


def _spans(dive: Dive, vehicle: VehicleFile | None) -> tuple[Span, ...]:
    try:
        configuration = "" if vehicle is None else vehicle.configuration_of(dive.configuration_index())
        return spans(dive, vehicle, configuration)
    except SeatrialError:
        return spans(dive)


def _key(folder: Path, files: list[Path], vehicle: VehicleFile | None) -> dict[str, Any]:
    """Everything that a glance depends on. `beside`: recordings not read, since a whole recording replaces them."""
    return {
        "version": VERSION,
        "recordings": [state_of(file) for file in files],
        "beside": [state_of(file) for file in recordings(folder) if file not in files],
        "vehicle": "" if vehicle is None else f"{vehicle.sha256}:{vehicle.configuration or ''}",
    }


def _keep(folder: Path, key: dict[str, Any], glance: Glance) -> None:
    """Cache a glance, completely or not at all; a folder that can't be written has no cache."""
    file = folder / GLANCE
    with contextlib.suppress(OSError):
        write_whole(file, to_json({"key": key, "glance": asdict(glance)}))


def _results(folder: Path) -> Iterator[tuple[str, str]]:
    """The result files next to a recording: in a word or three its outcome, "" for none, and a description."""
    for path in sorted(folder.iterdir()):
        if path.suffix == ".param":
            yield "", f"parameters {path.name}"
        elif path.suffix == ".html":
            yield "", f"page {path.name}"
        elif path.suffix == ".json" and path.name != GLANCE:
            yield from _of_result(path)


def _of_result(path: Path) -> Iterator[tuple[str, str]]:
    try:
        data = from_json(read_small(path))
    except (OSError, ValueError):
        return
    for result in data if isinstance(data, list) else [data]:
        if isinstance(result, dict) and "outcome" in result and "parameters" in result:
            yield "identified", f"identified by {result.get('method', '?')}: {result['outcome']}"
        elif isinstance(result, dict) and isinstance(result.get("verdict"), str):
            yield "diagnosed", f"diagnosed: {result['verdict']}"
        elif isinstance(result, dict) and "raising" in result and result.get("dive") == path.parent.name:
            judged, mode = result["raising"], result.get("mode") or "an unknown mode"
            words = "nothing to judge" if judged is None else "GO" if judged["go"] else "NO-GO"
            yield ("validated" if judged is None else f"{words} in {mode}"), f"validated in {mode}: {words}"
