"""Dives as a list shows them: date, length, loss, coefficients that each could identify, and results so far.

Everything that requires reading the recording is cached next to it in a small file, which may be deleted. It is made
again if missing, or if the recording, the vehicle file or this program has changed.
"""

import contextlib
import json
import math
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, Final

from bridge import schema
from bridge.errors import ConfigError, LogError, SeatrialError
from bridge.files import read_small, whole
from bridge.plain import from_json
from bridge.text import printable
from bridge.vehicle.coefficients import COEFFICIENTS
from bridge.vehicle.config import VehicleFile, load_vehicle
from gcs_plugin.dives.folder import GLANCE, About, DiveFolder, began, is_date, list_folders, order, recordings
from gcs_plugin.locks import is_written
from identify.dive import Dive, Kind
from identify.glance.excitation import Span, excitation, spans
from identify.glance.loss import Loss, loss_of
from identify.ingest.open import date_of, read_dive, recording_files
from identify.run.recordings import stray_bytes
from tui.recordings import vehicle_named
from tui.show import plain

NOTHING_YET: Final = "is being recorded, nothing heard yet"
Load = Callable[[str], VehicleFile]

VERSION: Final = 8
GOOD, FAIR = 0.1, 0.3
"""Relative standard errors up to which a coefficient would be known well, and at all."""


@dataclass(frozen=True)
class Glance:
    """The contents of a recording at a glance. `loss` is NaN if no sequence numbers are recorded.

    `relative_std` by coefficient, inf for a coefficient that could not be identified; None if unknown, and `why_not`
    says why. `error` is set if the recording can't be read at all; `stray` reports bytes in it that belong to no
    message, `restarts` the vehicle's restarts and the run that is used, `lacking` the frames of other recordings that
    the whole recording lacks. `unheard_s` is the longest silence within the recording, 0 if there is none, and
    `unheard` says when it was and how to get its frames.
    """

    began_unix_s: float | None = None
    duration_s: float = math.nan
    loss: float = math.nan
    relative_std: dict[str, float] | None = None
    spans: tuple[Span, ...] = ()
    why_not: str = ""
    error: str = ""
    stray: str = ""
    restarts: str = ""
    lacking: str = ""
    unheard_s: float = 0.0
    unheard: str = ""


@dataclass(frozen=True)
class DiveRow:
    """A dive in a list; `notes` and `events` are the crew's own words, each event with its time.

    `learnt` describes the results next to it, `worked_on` names their kinds ("identified", "diagnosed"); `conditions`
    describes the dive's conditions in a line. `damaged` says why its `dive.yaml` can't be read,
    `underway` that it is being recorded and holds nothing yet.
    """

    folder: Path
    name: str
    size_bytes: int
    glance: Glance
    notes: str
    events: tuple[str, ...]
    learnt: tuple[str, ...]
    worked_on: tuple[str, ...] = ()
    conditions: str = ""
    damaged: str = ""
    underway: str = ""


def dive_folders(root: Path) -> list[Path]:
    """`root` itself if it is a dive folder, otherwise the dive folders in it, the oldest first. Raises LogError if
    `root` is no folder."""
    if not root.is_dir():
        problem = "is a file" if root.exists() else "no such folder"
        raise LogError(f"{root}: {problem}; give the folder that holds the dives")
    return [root] if recordings(root) else [folder.path for folder in list_folders(root)]


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
    glance = _kept(folder, key)
    if glance is None:
        glance = _looked(folder, vehicle)
        _keep(folder, key, glance)
    if trouble:
        glance = replace(glance, why_not=trouble)
    size = sum(size for _, size, _ in key["recordings"])
    underway = ""
    if glance.error and not size and any(is_written(file) for file in recordings(folder)):
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


def kept_glance(folder: Path) -> Glance | None:
    """The cached glance at a dive, made with any vehicle file; None if the recordings have changed since."""
    try:
        kept = from_json(read_small(folder / GLANCE))["key"]
        states = {str(state[0]): state for state in (*kept["recordings"], *kept["beside"])}
        if all(states.get(file.name) == _state(file) for file in recordings(folder)):
            return _kept(folder, kept | {"version": VERSION})
    except (OSError, ValueError, LookupError, TypeError):
        pass
    return None


def short_name(folder: Path) -> str:
    """`hovering` of `2026-11-20T0912Z-hovering`; the whole name if a folder is named in another way."""
    name = folder.resolve().name
    date, mark, title = name.partition("Z-")
    return title if mark and title and date[:4].isdecimal() else name


def letters(relative_std: dict[str, float] | None, kind: str) -> str:
    """A letter for each of the six coefficients of a kind ("mass", "damping"), by its axis.

    A capital if it would be known to 10 %, a small letter to 30 %, a dot if not at all; dashes if nothing is known.
    """
    names = [coefficient.name for coefficient in COEFFICIENTS if coefficient.kind == kind]
    if relative_std is None:
        return "-" * len(names)
    return "".join(_letter(name[-1], relative_std.get(name, math.inf)) for name in names)


def _letter(axis: str, relative_std: float) -> str:
    if relative_std > FAIR:
        return "·"
    return axis.upper() if relative_std <= GOOD else axis


def _recordings(folder: Path) -> list[Path]:
    try:
        return recording_files(folder)
    except LogError:
        return []


def _looked(folder: Path, vehicle: VehicleFile | None) -> Glance:
    """Read the recording for a glance."""
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
    files = [file for file in _recordings(folder) if file.name.endswith((".tlog", ".tlog.gz"))]
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
        "recordings": [_state(file) for file in files],
        "beside": [_state(file) for file in recordings(folder) if file not in files],
        "vehicle": "" if vehicle is None else f"{vehicle.sha256}:{vehicle.configuration or ''}",
    }


def _state(file: Path) -> list[str | int]:
    """Name, size and time of change of a recording; zeros if it can't be opened."""
    try:
        state = file.stat()
    except OSError:
        return [file.name, 0, 0]
    return [file.name, state.st_size, state.st_mtime_ns]


def _kept(folder: Path, key: dict[str, Any]) -> Glance | None:
    """The cached glance; None if there is none, or it has another key."""
    file = folder / GLANCE
    try:
        data = from_json(read_small(file))
        if data["key"] != key:
            return None
        values, spans = _without_null(data["glance"]), data["glance"]["spans"]
        std = values.get("relative_std", {})
        known = values | {
            "relative_std": _without_null(std),
            "spans": [_without_null(span) for span in spans],
        }
        glance = schema.build(Glance, known, str(file))
    except (OSError, ValueError, KeyError, TypeError, AttributeError, ConfigError):
        return None
    if glance.began_unix_s is not None and not is_date(glance.began_unix_s):
        return None
    if "relative_std" not in values:
        return replace(glance, relative_std=None)
    finite = glance.relative_std or {}
    return replace(glance, relative_std={name: finite.get(name, math.inf) for name in std})


def _without_null(data: dict[str, Any]) -> dict[str, Any]:
    """Drop null values: they stand for numbers that JSON can't represent."""
    return {key: value for key, value in data.items() if value is not None}


def _keep(folder: Path, key: dict[str, Any], glance: Glance) -> None:
    """Cache a glance, completely or not at all; a folder that can't be written has no cache."""
    file = folder / GLANCE
    text = json.dumps(plain({"key": key, "glance": asdict(glance)}), allow_nan=False)
    with contextlib.suppress(OSError), whole(file) as out:
        out.write(text.encode())


def _results(folder: Path) -> Iterator[tuple[str, str]]:
    """The result files next to a recording: "identified", "diagnosed" or "" for each, and a description."""
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
