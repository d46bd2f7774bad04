"""Other recorders' files put to a dive: one made whole of all frames, or an autopilot's log that is read with it."""

import shutil
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from bridge.clock import SystemClock
from bridge.errors import LogError, SeatrialError
from bridge.new_file import replacing
from bridge.recorded_keys import LEFT_OUT, holds_key
from bridge.ring.whole import WHOLE
from bridge.tlog import load_recording, of_those_that_hold_frames, read_tlog
from gcs_plugin.fetch.remade import refuse_recorded, remade, renew
from gcs_plugin.fetch.whole import Apart, Strangers, Whole, made_whole
from gcs_plugin.folder import DiveFolder
from gcs_plugin.in_use import alone_at
from tui.whole_words import beyond_words, guessed_words, lacking_words, steps_words

FEWEST, LEAST_SHARE = 20, 0.3
"""Frames that both must have, and of those that were heard meanwhile: two vehicles say the same now and then."""
TLOGS, LOGS = (".tlog", ".tlog.gz"), (".bin",)
SAME_CLOCK_S = 1.0
BY_BOOT = "It has no frame in common with the dive, and is dated by the vehicle's time since boot"
MORE = "merge what else was recorded then, or fetch it where the vehicle keeps a recording"
GROUNDS = 240
"""System ids from here on are ground stations'."""
AGAIN = "merge again"


@dataclass(frozen=True)
class Merged:
    """What came of one file: the file in the dive's folder that now holds what it had, and a sentence for the crew."""

    file: Path
    into: Path
    words: str


@dataclass(frozen=True)
class Refused:
    """A file that was not put to the dive, and why, in a sentence."""

    file: Path
    words: str


def merge_all(folder: DiveFolder, files: Sequence[Path]) -> Iterator[Merged | Refused]:
    """Put recordings to a dive, one after the other; one that can't be is told, and the others go on.

    One that has hardly a frame in common is tried again once another was put to the dive: that may overlap both.
    """
    strange: dict[Path, str] = {}
    left = list(files)
    while left:
        file = left.pop(0)
        try:
            yield merge(folder, file)
            left += strange
            strange.clear()
        except Strangers as error:
            strange[file] = str(error)
        except SeatrialError as error:
            yield Refused(file, str(error))
        except OSError as error:
            yield Refused(
                file, f"{error.filename or file}: {error.strerror}; check the path, its rights and the disk"
            )
    for file, words in strange.items():
        yield Refused(file, words)


def merge(folder: DiveFolder, file: Path) -> Merged:
    """Put one recording to a dive. The file and all that was recorded stay as they are.

    Raises LogError where it can't be read, or is of another vehicle, dive or boot, or the dive is still recorded, or
    somebody else is at it: then nothing is changed.
    """
    name = file.name.lower()
    if not name.endswith((*TLOGS, *LOGS)):
        raise LogError(f"{file}: can't tell what this is by its ending; give a .tlog, a .tlog.gz or a .BIN")
    with alone_at(folder.path, AGAIN):
        return _frames(folder, file) if name.endswith(TLOGS) else _log(folder, file)


def _frames(folder: DiveFolder, file: Path) -> Merged:
    """Every frame of both once."""
    load_recording(file)  # which says what is wrong with one that holds none
    refuse_recorded(folder, SystemClock().unix_s(), AGAIN)
    present = folder.telemetry()
    source, into = _busiest(present), folder.path / WHOLE
    if any(file.samefile(one) for one in (*folder.heard(), *present)):
        return _own(folder, file, source)
    strangers = f"{file}: has hardly a frame in common with the dive; check that it is of this dive"

    def make(ground: Sequence[Path]) -> Whole:
        try:
            found = made_whole(ground, [file], source, strangers)
        except Apart as error:
            raise Strangers(_apart(folder, file, error)) from None
        if not found.by_boot and (found.common < FEWEST or found.share < LEAST_SHARE):
            raise Strangers(strangers)
        return found

    found = remade(folder, source, make, AGAIN)
    key = f" {LEFT_OUT}" if any(map(holds_key, (*present, file))) else ""
    return Merged(file, into, _came(file, into, found) + key)


def _came(file: Path, into: Path, found: Whole) -> str:
    """What came of it, in words."""
    begins_us, ends_us = found.records[0][0], found.records[-1][0]
    lacking = lacking_words(found.holes, found.lost)
    what = "what there is of the dive is" if lacking else "the dive is whole"
    told = [
        f"{file.name}: its clock {found.clock.words(begins_us * 1e-6, ends_us * 1e-6)}",
        BY_BOOT if found.by_boot else "",
        steps_words(found.steps, begins_us),
        f"{found.missing} of {len(found.records)} frames had not been heard; {what} in {into}",
        f"{lacking}; {MORE}" if lacking else "",
        guessed_words(found.guessed),
        beyond_words(found.beyond),
    ]
    return " ".join(f"{sentence}." for sentence in told if sentence)


def _apart(folder: DiveFolder, file: Path, error: Apart) -> str:
    """What a crew is told of a recording that follows on the dive, or that it follows on, and what to do with it."""
    if error.after_s > 0:
        where = f"begins {error.after_s:.0f} s after the dive's recording ends"
    else:
        where = f"ends {-error.after_s:.0f} s before the dive's recording begins"
    told = f"{file}: is of the same start of the same vehicle, {where}, and has nothing in common with it"
    if abs(error.ahead_s) > SAME_CLOCK_S:
        return (
            f"{told}; its clock is {abs(error.ahead_s):.1f} s {'ahead' if error.ahead_s > 0 else 'behind'}, so that it "
            "can't be read beside it: give one that overlaps both as well"
        )
    if error.after_s < 0:
        return f"{told}; put the dive's recordings into the folder of this one, under the numbers that follow"
    numbers = {path.name for path in folder.heard()}
    name = next(name for name in (f"telemetry.{k}.tlog" for k in range(2, 1 << 20)) if name not in numbers)
    return f"{told}; put it into the folder as {name}, and all that reads the dive reads it after the others"


def _own(folder: DiveFolder, file: Path, source: tuple[int, int]) -> Merged:
    """Put what the dive's own recordings have had since the whole one was made into that."""
    into = folder.path / WHOLE
    renewed = renew(folder, source) if file.name != WHOLE else None
    if renewed is None:
        raise LogError(f"{file}: is this dive's own recording; give what another recorder made")
    key = f" {LEFT_OUT}" if any(map(holds_key, folder.heard())) else ""
    return Merged(
        file,
        into,
        f"{file.name}: what was recorded, or put there, after {into} was made is in it now: {len(renewed.records)} "
        f"frames.{key}",
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
