"""`seatrial merge`: add other recorders' logs of a dive to its folder, on the dive's clock."""

import argparse
import shutil
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from bridge import clock as clocks
from bridge import exit_codes
from bridge.errors import LogError, SeatrialError
from bridge.files import replacing
from bridge.wire.tlog import SUFFIXES, each_nonempty, load_recording, read_tlog
from bridge.wire.whole_recording import GROUNDS, WHOLE
from gcs_plugin.dives.folder import DiveFolder, load_folder
from gcs_plugin.fetch.into_dive import refuse_recorded, remade, renew
from gcs_plugin.fetch.merge_order import Hole
from gcs_plugin.fetch.merging import MergedRecording, merge_recordings
from gcs_plugin.locks import merge_lock
from identify.ingest.mavlink.autopilot_log import merged
from identify.ingest.mavlink.messages import clock
from identify.ingest.mavlink.tlog import read_tlog as read_fields
from identify.words import listed
from tui import show
from tui.cli import complain

FEWEST, LEAST_SHARE = 20, 0.3
"""Least number of common frames, and least share of those heard meanwhile; two vehicles may send equal bytes."""
LOGS = (".bin",)
MORE = "merge what else was recorded then, or fetch it where the vehicle keeps a recording"
AGAIN = "merge again"


def run(arguments: argparse.Namespace) -> int:
    folder = load_folder(Path(arguments.dive))
    came: list[Merged] = []
    try:
        for merged in merge_all(folder, [Path(name) for name in arguments.files]):
            came.append(merged)
            if merged.into is None:
                complain(merged.words)
            else:
                show.say(show.results(arguments.json), merged.words)
        done, refused = (
            [merged.file.name for merged in came if (merged.into is None) == no] for no in (False, True)
        )
        if done and refused:
            show.say(show.words(), f"merged: {', '.join(done)}; not merged: {', '.join(refused)}")
    finally:
        show.write_json(
            [{"file": merged.file, "into": merged.into, "told": merged.words} for merged in came],
            arguments.json,
        )
    return exit_codes.BAD_INPUT if refused else exit_codes.DONE


@dataclass(frozen=True)
class Merged:
    """The outcome for a file, in a sentence for the crew; `into`: the file in the dive's folder that now holds its
    data, None if it was not added."""

    file: Path
    into: Path | None
    words: str


def merge_all(folder: DiveFolder, files: Sequence[Path]) -> Iterator[Merged]:
    """Add recordings to a dive in turn; a file that can't be added is reported, and the others go on."""
    for file in files:
        try:
            yield merge(folder, file)
        except SeatrialError as error:
            yield Merged(file, None, str(error))
        except OSError as error:
            subject = error.filename or file
            yield Merged(file, None, f"{subject}: {error.strerror}; check the path, its rights and the disk")


def merge(folder: DiveFolder, file: Path) -> Merged:
    """Add a recording to a dive. The file and the dive's original recordings stay unchanged.

    Raises LogError if it can't be read, is of another vehicle, dive or boot, if the dive is still recorded, or if
    another process is at work on it: then nothing is changed.
    """
    name = file.name.lower()
    if not name.endswith((*SUFFIXES, *LOGS)):
        raise LogError(f"{file}: can't tell what this is by its ending; give a .tlog, a .tlog.gz or a .BIN")
    with merge_lock(folder.path, AGAIN):
        return _frames(folder, file) if name.endswith(SUFFIXES) else _log(folder, file)


def _frames(folder: DiveFolder, file: Path) -> Merged:
    """Merge so that every frame of both recordings occurs once."""
    load_recording(file)  # reports the problem of a file without frames
    refuse_recorded(folder, clocks.SystemClock().unix_s(), AGAIN)
    present = folder.telemetry()
    source, into = _busiest(present), folder.path / WHOLE
    if any(file.samefile(recording) for recording in (*folder.heard(), *present)):
        return _renewed(folder, file, source)
    strangers = f"{file}: has hardly a frame in common with the dive; check that it is of this dive"

    def make(ground: Sequence[Path]) -> MergedRecording:
        merged_frames = merge_recordings(ground, [file], source, strangers)
        if merged_frames.common < FEWEST or merged_frames.share < LEAST_SHARE:
            raise LogError(strangers)
        return merged_frames

    merged_frames = remade(folder, source, make, AGAIN)
    return Merged(file, into, _came(file, into, merged_frames))


def _came(file: Path, into: Path, whole: MergedRecording) -> str:
    begins_us, ends_us = whole.records[0][0], whole.records[-1][0]
    lacking = lacking_words(whole.holes, whole.lost)
    subject = "what there is of the dive is" if lacking else "the dive is whole"
    sentences = [
        f"{file.name}: its clock {whole.clock.words(begins_us * 1e-6, ends_us * 1e-6)}",
        f"{whole.missing} of {len(whole.records)} frames had not been heard; {subject} in {into}",
        f"{lacking}; {MORE}" if lacking else "",
        guessed_words(whole.guessed),
        beyond_words(whole.beyond),
    ]
    return " ".join(f"{sentence}." for sentence in sentences if sentence)


def _renewed(folder: DiveFolder, file: Path, source: tuple[int, int]) -> Merged:
    """Add to the whole recording all that the dive's own recordings have gained since it was made."""
    into = folder.path / WHOLE
    renewed = renew(folder, source) if file.name != WHOLE else None
    if renewed is None:
        raise LogError(f"{file}: is this dive's own recording; give what another recorder made")
    return Merged(
        file,
        into,
        f"{file.name}: what was recorded, or put there, after {into} was made is in it now: {len(renewed.records)} "
        f"frames.",
    )


def _busiest(recordings: list[Path]) -> tuple[int, int]:
    """System and component of the vehicle that sent most frames."""
    counts = Counter(
        (frame.system, frame.component)
        for records in each_nonempty(recordings, read_tlog)
        for _, frame in records
        if frame.system < GROUNDS
    )
    if not counts:
        raise LogError(f"{recordings[0]}: holds no frame of a vehicle")
    return counts.most_common(1)[0][0]


def _log(folder: DiveFolder, file: Path) -> Merged:
    """Copy the log into the folder, so that every reader of the dive reads it too."""
    heard = folder.telemetry()
    if file.name.startswith("telemetry"):
        raise LogError(f"{file}: is named as a dive's own recording is; give it another name")
    sentence = merged(read_fields(heard, str(folder.path)), heard, file)["notes"][-1]
    into = folder.path / file.name
    if into.exists() and not into.is_file():
        raise LogError(f"{into}: is no file; take it away")
    if into.exists() and not into.samefile(file) and into.read_bytes() != file.read_bytes():
        raise LogError(f"{into}: is there already, and is another log; give {file} another name")
    if not into.exists():
        with replacing(into, "merge again") as copied, file.open("rb") as log:
            shutil.copyfileobj(log, copied)
    return Merged(file, into, sentence)


MOST_NAMED: Final = 3
"""Number of entries that are named individually if there are many."""


def lacking_words(holes: Sequence[Hole], lost: int) -> str:
    """`58 s of it, from 0:18 on, nobody has`; "" if nothing shows that frames are missing."""
    longest = sorted(
        sorted(holes, key=lambda hole: -hole.length_s)[:MOST_NAMED], key=lambda hole: hole.after_s
    )
    parts = [f"{hole.length_s:.0f} s of it, from {clock(hole.after_s)} on" for hole in longest]
    if len(holes) > len(longest):
        parts.append(f"{len(holes) - len(longest)} shorter times")
    if lost:
        parts.append(f"{lost} {'single frames' if lost > 1 else 'single frame'}")
    return f"{listed(parts)}, nobody has" if parts else ""


def beyond_words(beyond: int) -> str:
    """Number of frames left out because of their time; "" for none."""
    if not beyond:
        return ""
    were, are = ("frame of it was", "is") if beyond == 1 else ("frames of it were", "are")
    return f"{beyond} {were} sent before the dive's first frame or after its last and {are} left out"


def guessed_words(guessed: int) -> str:
    """Number of frames that are dated by a guess; "" for none."""
    if not guessed:
        return ""
    were, they_are = ("frame of it was", "it is") if guessed == 1 else ("frames of it were", "they are")
    return (
        f"When {guessed} {were} sent is a guess: between two of its starts nobody else heard any, and {they_are} dated "
        "from the end of the one before"
    )
