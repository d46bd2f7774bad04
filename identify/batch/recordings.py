"""The DIVES of a command line, files, folders and patterns, to recordings: each counted once."""

import glob
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from bridge.errors import LogError
from identify.batch.jobs import Recording, Result
from identify.ingest.open import recording_files, sha256_of

ENDINGS = (".tlog", ".tlog.gz", ".bin")
TABLE = ".csv"
DIVE_FILE = "telemetry."


@dataclass(frozen=True)
class Found:
    """`recordings` to work on; `twins`, each a path and that of the same bytes; the failures of the `unreadable`."""

    recordings: tuple[Recording, ...]
    twins: tuple[tuple[Path, Path], ...]
    unreadable: tuple[Result, ...]


def find_recordings(
    words: Sequence[str], progress: Callable[[float, str], None] = lambda _done, _what: None
) -> Found:
    """The recordings that DIVES mean. Raises LogError for a word that means none.

    A dive folder is one recording; in any other folder each recording is one, and so on down. A table (.csv) that
    is not a dive folder's has to be named. A recording that was given before, by the SHA-256 of its bytes, is a twin;
    a dive folder comes before a file.
    """
    paths = sorted((path for word in words for path in _paths(word)), key=Path.is_file)
    recordings: dict[str, Recording] = {}
    twins: dict[Path, Path] = {}
    unreadable: list[Result] = []
    for number, path in enumerate(paths):
        progress(number / len(paths), f"read {path.name}")
        try:
            files = tuple(recording_files(path))
            sha256 = sha256_of(files)
        except LogError as error:
            unreadable.append(Result(str(path), name_of(path), str(path), "", error=str(error), final=False))
            continue
        if sha256 in recordings:
            twins[path] = recordings[sha256].path
        else:
            recordings[sha256] = Recording(name_of(path), path, files, sha256)
    return Found(tuple(recordings.values()), tuple(twins.items()), tuple(unreadable))


def name_of(path: Path) -> str:
    """What a recording is called: its folder or its file, without an ending."""
    name = path.resolve().name
    for ending in (*ENDINGS[::-1], TABLE):
        if name.lower().endswith(ending):
            return name[: -len(ending)]
    return name


def _paths(word: str) -> list[Path]:
    """The recordings that one word means, each a file or a dive folder, in the order of their names."""
    path = Path(word)
    if path.exists():
        found = [path] if path.is_file() else list(_in_folder(path))
        nothing = "holds no recording; give a folder of dives, a dive folder or a recording"
    else:
        places = [Path(place) for place in sorted(glob.glob(word, recursive=True))]
        found = [one for p in places for one in ([p] if p.is_file() else _in_folder(p))]
        nothing = "no such file or folder; check the name"
    if not found:
        raise LogError(f"{word}: {nothing}")
    return found


def _in_folder(folder: Path) -> Iterator[Path]:
    for place, folders, files in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        if any(_is_dive_file(name) for name in files):
            folders.clear()
            yield Path(place)
            continue
        yield from (Path(place) / name for name in sorted(files) if name.lower().endswith(ENDINGS))


def _is_dive_file(name: str) -> bool:
    return name.startswith(DIVE_FILE) and name.lower().endswith((*ENDINGS, TABLE))
