"""Other recorders' files put to a dive: one made whole of all frames, or an autopilot's log that is read with it."""

import shutil
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from bridge.errors import LogError
from bridge.new_file import replacing
from bridge.recorded_keys import LEFT_OUT, holds_key
from bridge.ring.whole import WHOLE
from bridge.tlog import of_those_that_hold_frames, read_tlog
from gcs_plugin.fetch.whole import made_whole, write_records
from gcs_plugin.folder import DiveFolder

FEWEST, LEAST_SHARE = 20, 0.3
"""Frames that both must have, and of those that were heard meanwhile: two vehicles say the same now and then."""
TLOGS, LOGS = (".tlog", ".tlog.gz"), (".bin",)
GROUNDS = 240
"""System ids from here on are ground stations'."""


@dataclass(frozen=True)
class Merged:
    """What came of one file: the file in the dive's folder that now holds what it had, and a sentence for the crew."""

    file: Path
    into: Path
    words: str


def merge(folder: DiveFolder, file: Path) -> Merged:
    """Put one recording to a dive. The file and all that was recorded stay as they are.

    Raises LogError where it can't be read, or is of another vehicle, dive or boot: then nothing is changed.
    """
    name = file.name.lower()
    if name.endswith(TLOGS):
        return _frames(folder, file)
    if name.endswith(LOGS):
        return _log(folder, file)
    raise LogError(f"{file}: can't tell what this is by its ending; give a .tlog, a .tlog.gz or a .BIN")


def _frames(folder: DiveFolder, file: Path) -> Merged:
    """Every frame of both once."""
    present = folder.telemetry()
    if any(file.samefile(one) for one in present) or file.name == WHOLE:
        raise LogError(f"{file}: is this dive's own recording; give what another recorder made")
    strangers = f"{file}: has hardly a frame in common with the dive; check that it is of this dive"
    found = made_whole(present, [file], _busiest(present), strangers)
    if found.common < FEWEST or found.share < LEAST_SHARE:
        raise LogError(strangers)
    into = folder.path / WHOLE
    write_records(into, found.records)
    beyond = (
        f" {found.beyond} frames of it lie before or after the dive and are left out." if found.beyond else ""
    )
    key = f" {LEFT_OUT}" if any(map(holds_key, (*present, file))) else ""
    span_s = found.records[0][0] * 1e-6, found.records[-1][0] * 1e-6
    return Merged(
        file,
        into,
        f"{file.name}: its clock {found.clock.words(*span_s)}. {found.missing} of {len(found.records)} frames had not "
        f"been heard; the dive is whole in {into}.{beyond}{key}",
    )


def _busiest(recordings: list[Path]) -> tuple[int, int]:
    """System and component of the vehicle that says most."""
    said = Counter(
        (frame.system, frame.component)
        for records in of_those_that_hold_frames(recordings, read_tlog)
        for _, frame in records
        if frame.system < GROUNDS
    )
    if not said:
        raise LogError(f"{recordings[0]}: holds no frame of a vehicle")
    return said.most_common(1)[0][0]


def _log(folder: DiveFolder, file: Path) -> Merged:
    """A copy of it in the folder, where all that reads the dive reads it too."""
    from identify.ingest.logs import merged
    from identify.ingest.tlog import read_tlog as read_fields

    heard = folder.telemetry()
    if file.name.startswith("telemetry"):
        raise LogError(f"{file}: is named as a dive's own recording is; give it another name")
    told = merged(read_fields(heard, str(folder.path)), heard, file)["notes"][-1]
    into = folder.path / file.name
    if into.exists() and not into.is_file():
        raise LogError(f"{into}: is no file; take it away")
    if into.exists() and not into.samefile(file) and into.read_bytes() != file.read_bytes():
        raise LogError(f"{into}: is there already, and is another log; give {file} another name")
    if not into.exists():
        _copy(file, into)
    return Merged(file, into, told)


def _copy(file: Path, into: Path) -> None:
    """Whole or not at all."""
    with replacing(into, "merge again") as copied, file.open("rb") as log:
        shutil.copyfileobj(log, copied)
