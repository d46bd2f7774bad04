"""Dives as a list shows them: when, how long, what was lost, what each could identify, what was learnt from it.

What takes reading the recording is kept beside it in a small file, which may be thrown away: it is made again, as it is
where the recording, the vehicle file or this program is another.
"""

import contextlib
import json
import math
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from bridge import schema
from bridge.errors import ConfigError, LogError, SeatrialError
from bridge.file_size import read_small
from bridge.new_file import whole
from bridge.plain import from_json
from bridge.printable import printable
from bridge.ring.made_since import AFTERWARDS
from bridge.vehicle.config import VehicleFile, load_vehicle
from gcs_plugin.dive_order import GLANCE, began, is_date, order, recordings
from gcs_plugin.folder import About, DiveFolder, list_folders
from gcs_plugin.in_use import is_written
from tui.dive_vehicle import vehicle_named
from tui.show import plain
from tui.stray_bytes import stray_bytes

if TYPE_CHECKING:
    from identify.dive import Dive
    from identify.glance.loss import Loss

NOTHING_YET: Final = "is being recorded, nothing heard yet"
Load = Callable[[str], VehicleFile]

VERSION: Final = 8
GOOD, FAIR = 0.1, 0.3
"""Relative standard errors up to which a coefficient would be known well, and at all."""


@dataclass(frozen=True)
class AxisSpan:
    """One axis: seconds with thrust and readings, and how far thrust and speed went; NaN for not recorded."""

    axis: str
    seconds: float
    thrust: float = math.nan
    speed: float = math.nan


@dataclass(frozen=True)
class Glance:
    """What the recording itself tells. `loss` is NaN where no sequence numbers are recorded.

    `relative_std` by coefficient, inf for what could not be identified; empty where `why_not` says why nobody knows.
    `error` where the recording can't be read at all; `stray` tells of bytes in it that belong to no message,
    `restarts` of the vehicle's and of the run that is used, `lacking` of what the whole recording lacks of the others.
    `unheard_s` is the longest silence within the recording, 0
    for none, and `unheard` says when it was and what brings the frames.
    """

    began_unix_s: float | None = None
    duration_s: float = math.nan
    loss: float = math.nan
    relative_std: dict[str, float] | None = None
    spans: tuple[AxisSpan, ...] = ()
    why_not: str = ""
    error: str = ""
    stray: str = ""
    restarts: str = ""
    lacking: str = ""
    unheard_s: float = 0.0
    unheard: str = ""


@dataclass(frozen=True)
class DiveRow:
    """One dive of a list; `notes` and `events` are the crew's own words, each event with its time.

    `conditions` is what the dive was made under, in a line. `damaged` says why its `dive.yaml` can't be read,
    `underway` that it is being recorded and holds nothing yet.
    """

    folder: Path
    name: str
    size_bytes: int
    glance: Glance
    notes: str
    events: tuple[str, ...]
    learnt: tuple[str, ...]
    conditions: str = ""
    damaged: str = ""
    underway: str = ""


def dive_folders(root: Path) -> list[Path]:
    """`root` itself where it is a dive folder, else those in it, the oldest first. Raises LogError where `root` is
    none."""
    if not root.is_dir():
        what = "is a file" if root.exists() else "no such folder"
        raise LogError(f"{root}: {what}; give the folder that holds the dives")
    return [root] if recordings(root) else [folder.path for folder in list_folders(root)]


def row_of(
    folder: Path, named: VehicleFile | None = None, otherwise: str = "", load: Load = load_vehicle
) -> DiveRow:
    """One dive; `named` is the vehicle file to judge it by, else the one that `dive.yaml` names, else `otherwise`."""
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
    events = tuple(f"{event.utc} {event.text}" for event in about.events)
    return DiveRow(
        folder,
        printable(short_name(folder), "?"),
        size,
        glance,
        about.notes,
        events,
        tuple(_learnt(folder)),
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
    return sorted(rows, key=lambda row: order(row.folder))  # by what was told meanwhile of some


def kept_glance(folder: Path) -> Glance | None:
    """What was told of a dive when it was last read, by whatever vehicle file; None where it has changed since."""
    try:
        kept = from_json(read_small(folder / GLANCE))["key"]
        states = {str(state[0]): state for state in (*kept["recordings"], *kept["beside"])}
        if all(states.get(file.name) == _state(file) for file in recordings(folder)):
            return _kept(folder, kept | {"version": VERSION})
    except (OSError, ValueError, LookupError, TypeError):
        pass
    return None


def short_name(folder: Path) -> str:
    """`hovering` of `2026-11-20T0912Z-hovering`; the whole name of a folder that is called otherwise."""
    name = folder.resolve().name
    date, mark, rest = name.partition("Z-")
    return rest if mark and rest and date[:4].isdecimal() else name


def letters(relative_std: dict[str, float] | None, kind: str) -> str:
    """One letter for each of the six coefficients of a kind ("mass", "damping"), by its axis.

    A capital where it would be known to 10 %, a small one to 30 %, a dot where not at all; dashes where nobody knows.
    """
    from bridge.vehicle.coefficients import COEFFICIENTS

    names = [coefficient.name for coefficient in COEFFICIENTS if coefficient.kind == kind]
    if relative_std is None:
        return "-" * len(names)
    return "".join(_letter(name[-1], relative_std.get(name, math.inf)) for name in names)


def _letter(axis: str, relative_std: float) -> str:
    if relative_std > FAIR:
        return "·"
    return axis.upper() if relative_std <= GOOD else axis


def _recordings(folder: Path) -> list[Path]:
    from identify.ingest.open import recording_files

    try:
        return recording_files(folder)
    except LogError:
        return []


def _looked(folder: Path, vehicle: VehicleFile | None) -> Glance:
    """What reading the recording tells."""
    from identify.dates import date_of
    from identify.ingest.open import read_dive
    from identify.ingest.runs import RESTARTED

    columns = folder / "columns.yaml"
    # A pipe would be waited for without an end.
    odd = next((file for file in recordings(folder) if file.exists() and not file.is_file()), None)
    if odd is not None:
        return Glance(began_unix_s=began(folder), error=f"{odd}: is no file; take it away")
    try:
        dive = read_dive(folder, columns if columns.exists() else None, vehicle)
    except SeatrialError as error:
        return Glance(began_unix_s=began(folder), error=str(error))
    told, why_not = _excitation(dive, vehicle)
    loss = _loss(folder)
    return Glance(
        began_unix_s=date_of(dive)[0],
        duration_s=dive.duration_s,
        loss=math.nan if loss is None else loss.share,
        relative_std=told,
        spans=_spans(dive, vehicle),
        why_not=why_not,
        stray=stray_bytes(folder),
        restarts=next((note for note in dive.notes if note.startswith(RESTARTED)), ""),
        lacking=next((note for note in dive.notes if AFTERWARDS in note), ""),
        unheard_s=0.0 if loss is None else loss.unheard_s,
        unheard="" if loss is None else loss.note,
    )


def _loss(folder: Path) -> "Loss | None":
    """None where no sequence numbers are recorded."""
    from identify.glance.loss import loss_of

    files = [file for file in _recordings(folder) if file.name.endswith((".tlog", ".tlog.gz"))]
    beside = [file for file in recordings(folder) if file not in files]
    return loss_of(files, str(folder), beside) if files else None


def _excitation(dive: "Dive", vehicle: VehicleFile | None) -> tuple[dict[str, float] | None, str]:
    from identify.glance.excitation import excitation

    if vehicle is None:
        return None, "no vehicle file is known; give one with --vehicle"
    try:
        found = excitation(dive, vehicle, _configuration(dive, vehicle))
    except SeatrialError as error:
        return None, str(error)
    return {one.name: one.relative_std for one in found.coefficients}, found.note


def _spans(dive: "Dive", vehicle: VehicleFile | None) -> tuple[AxisSpan, ...]:
    from identify.glance.excitation import spans

    try:
        configuration = "" if vehicle is None else _configuration(dive, vehicle)
        found = spans(dive, vehicle, configuration)
    except SeatrialError:
        found = spans(dive)
    return tuple(AxisSpan(s.axis, s.seconds, s.thrust, s.speed) for s in found)


def _configuration(dive: "Dive", vehicle: VehicleFile) -> str:
    return vehicle.configuration or vehicle.vehicle.configuration_at(dive.configuration_index())


def _key(folder: Path, files: list[Path], vehicle: VehicleFile | None) -> dict[str, Any]:
    """What a glance depends on. `beside`: recordings that are not read, since a whole one stands for them."""
    return {
        "version": VERSION,
        "recordings": [_state(file) for file in files],
        "beside": [_state(file) for file in recordings(folder) if file not in files],
        "vehicle": "" if vehicle is None else f"{vehicle.sha256}:{vehicle.configuration or ''}",
    }


def _state(file: Path) -> list[str | int]:
    """Name, size and time of change of a recording; zeros for one that can't be opened."""
    try:
        state = file.stat()
    except OSError:
        return [file.name, 0, 0]
    return [file.name, state.st_size, state.st_mtime_ns]


def _kept(folder: Path, key: dict[str, Any]) -> Glance | None:
    """The glance that was kept; None where there is none, or of something else."""
    file = folder / GLANCE
    try:
        data = from_json(read_small(file))
        if data["key"] != key:
            return None
        told, spans = _without_null(data["glance"]), data["glance"]["spans"]
        std = told.get("relative_std", {})
        known = told | {"relative_std": _without_null(std), "spans": [_without_null(one) for one in spans]}
        glance = schema.build(Glance, known, str(file))
    except (OSError, ValueError, KeyError, TypeError, AttributeError, ConfigError):
        return None
    if glance.began_unix_s is not None and not is_date(glance.began_unix_s):
        return None
    if "relative_std" not in told:
        return replace(glance, relative_std=None)
    found = glance.relative_std or {}
    return replace(glance, relative_std={name: found.get(name, math.inf) for name in std})


def _without_null(data: dict[str, Any]) -> dict[str, Any]:
    """What is told of it: JSON has no numbers that do not exist."""
    return {key: value for key, value in data.items() if value is not None}


def _keep(folder: Path, key: dict[str, Any], glance: Glance) -> None:
    """Keep it, whole or not at all; a folder that can't be written does without."""
    file = folder / GLANCE
    text = json.dumps(plain({"key": key, "glance": asdict(glance)}), allow_nan=False)
    with contextlib.suppress(OSError), whole(file) as made:
        made.write(text.encode())


def _learnt(folder: Path) -> Iterator[str]:
    """What the files beside a recording say, in words."""
    for path in sorted(folder.iterdir()):
        if path.suffix == ".param":
            yield f"parameters {path.name}"
        elif path.suffix == ".html":
            yield f"page {path.name}"
        elif path.suffix == ".json" and path.name != GLANCE:
            yield from _of_result(path)


def _of_result(path: Path) -> Iterator[str]:
    try:
        data = from_json(read_small(path))
    except (OSError, ValueError):
        return
    for one in data if isinstance(data, list) else [data]:
        if isinstance(one, dict) and "outcome" in one and "parameters" in one:
            yield f"identified by {one.get('method', '?')}: {one['outcome']}"
        elif isinstance(one, dict) and isinstance(one.get("verdict"), str):
            yield f"diagnosed: {one['verdict']}"
