"""The recordings that DIVES (files, folders, patterns) mean, each dive counted once."""

import glob
import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from bridge.errors import LogError
from bridge.wire.tlog import SUFFIXES
from identify.batch.jobs import Recording, Result
from identify.ingest.open import BAG_FOLDER, MAPPED, recording_files
from identify.ingest.same_dive import SAME, contents, identity_of

ENDINGS = (*SUFFIXES, ".bin")
DIVE_FILE = "telemetry."
BEGINNING: Final = "is the beginning of"


@dataclass(frozen=True)
class Twin:
    """A recording at `path` that does not count, because that at `counted` holds the same dive; `why` stands between
    the two names.
    """

    path: Path
    counted: Path
    why: str


@dataclass(frozen=True)
class Selection:
    """The recordings of a batch, each of a different dive; their `twins`; failed results for the `unreadable`."""

    recordings: tuple[Recording, ...]
    twins: tuple[Twin, ...]
    unreadable: tuple[Result, ...]


def find_recordings(
    words: Sequence[str], progress: Callable[[float, str], None] = lambda _done, _words: None
) -> Selection:
    """Find the recordings that DIVES mean. Raises LogError for a word that matches none.

    A dive folder is a single recording; every other folder is searched for recordings, recursively. What needs a
    column map (`open.MAPPED`) must be named itself outside a dive folder. A recording with the same SHA-256 of its
    uncompressed bytes as an earlier recording is a twin; dive folders come before files. So is the beginning of a
    longer recording; the longer recording counts.
    """
    paths = sorted((path for word in words for path in _paths(word)), key=Path.is_file)
    recordings: dict[str, Recording] = {}
    twins: dict[Path, Twin] = {}
    unreadable: list[Result] = []
    for number, path in enumerate(paths):
        progress(number / len(paths), f"read {path.name}")
        try:
            files = tuple(recording_files(path))
            known_by = identity_of(files)
        except LogError as error:
            unreadable.append(Result(str(path), name_of(path), str(path), "", error=str(error), final=False))
            continue
        if known_by.sha256 in recordings:
            twins[path] = Twin(path, recordings[known_by.sha256].path, SAME)
        else:
            recordings[known_by.sha256] = Recording(name_of(path), path, files, **vars(known_by))
    cut = {twin.path: twin for twin in _cut(recordings.values())}
    all_twins = tuple(
        replace(cut[t.counted], path=t.path) if t.counted in cut else t for t in (twins | cut).values()
    )
    complete = [recording for recording in recordings.values() if recording.path not in cut]
    return Selection(distinct_names(complete), all_twins, tuple(unreadable))


def distinct_names(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """The recordings, with as many parent folders before each repeated name as needed to make the names distinct."""
    out = list(recordings)
    for depth in range(1, max((len(recording.path.resolve().parts) for recording in out), default=1) - 1):
        often = Counter(recording.name for recording in out)
        for k, recording in enumerate(out):
            if often[recording.name] > 1:
                folders = recording.path.resolve().parts[-1 - depth : -1]
                out[k] = replace(recording, name="/".join((*folders, name_of(recording.path))))
    return tuple(out)


def _cut(recordings: Iterable[Recording]) -> list[Twin]:
    """Twins for recordings that are the beginning of another: copies that were cut, or made before the dive's end."""
    alike: dict[str, list[Recording]] = {}
    for recording in recordings:
        alike.setdefault(recording.opening, []).append(recording)
    alike.pop("", None)
    twins = []
    for group in alike.values():
        complete: list[tuple[Path, bytes]] = []
        for recording in sorted(group, key=lambda item: -item.size_bytes) if len(group) > 1 else ():
            data = contents(recording.files)
            longer = next((path for path, held in complete if held.startswith(data)), None)
            if longer is None:
                complete.append((recording.path, data))
            else:
                twins.append(Twin(recording.path, longer, BEGINNING))
    return twins


def name_of(path: Path) -> str:
    """Name of a recording: that of its folder or file, without the file ending."""
    name = path.resolve().name
    for ending in (*ENDINGS[::-1], *MAPPED):
        if name.lower().endswith(ending):
            return name[: -len(ending)]
    return name


def _paths(word: str) -> list[Path]:
    """Recordings that a word means, each a file or a dive folder, sorted by name."""
    path = Path(word)
    if path.exists():
        recordings = [path] if path.is_file() else list(_in_folder(path))
        nothing = "holds no recording; give a folder of dives, a dive folder or a recording"
    else:
        places = [Path(place) for place in sorted(glob.glob(word, recursive=True))]
        recordings = [recording for p in places for recording in ([p] if p.is_file() else _in_folder(p))]
        nothing = "no such file or folder; check the name"
    files = sorted(path.glob("*")) if path.is_dir() else []
    if not recordings and (mapped := [file for file in files if file.name.lower().endswith(MAPPED)]):
        what = "1 recording that needs" if len(mapped) == 1 else f"{len(mapped)} recordings that need"
        raise LogError(
            f"{word}: holds {what} a column map, as {mapped[0].name}, and a folder's other tables are no dives; name "
            f"those that are, as '{path / '*'}{mapped[0].suffix}', beside --columns"
        )
    if not recordings:
        raise LogError(f"{word}: {nothing}")
    return recordings


def _in_folder(folder: Path) -> Iterator[Path]:
    for place, folders, files in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        if BAG_FOLDER in files or any(_is_dive_file(name) for name in files):
            folders.clear()
            yield Path(place)
            continue
        yield from (Path(place) / name for name in sorted(files) if name.lower().endswith(ENDINGS))


def _is_dive_file(name: str) -> bool:
    return name.startswith(DIVE_FILE) and name.lower().endswith((*ENDINGS, *MAPPED))
