"""The DIVES of a command line, files, folders and patterns, to recordings: each counted once."""

import glob
import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from bridge.errors import LogError
from identify.batch.jobs import Recording, Result
from identify.ingest.identity import contents, identity_of
from identify.ingest.open import recording_files

ENDINGS = (".tlog", ".tlog.gz", ".bin")
TABLE = ".csv"
DIVE_FILE = "telemetry."

SAME, BEGINNING = "holds the same recording as", "is the beginning of"
"""How one recording may be another's twin, in words between their names."""

GAVE_NOTHING = "gave nothing ({why}), so what counts is its beginning,"


@dataclass(frozen=True)
class Twin:
    """A recording at `path` that does not count, for the one at `counted` is of the same dive; `why` in words.

    `recording` is that at `path` where it is a part of the other, and may count in its place.
    """

    path: Path
    counted: Path
    why: str
    recording: Recording | None = None


@dataclass(frozen=True)
class Found:
    """`recordings` to work on, each of another dive; their `twins`; the failures of the `unreadable`."""

    recordings: tuple[Recording, ...]
    twins: tuple[Twin, ...]
    unreadable: tuple[Result, ...]

    def beginnings_of(self, path: Path) -> tuple[Recording, ...]:
        """The recordings that are the beginning of the one at `path`, the longest first."""
        parts = (t.recording for t in self.twins if t.counted == path and t.recording is not None)
        return tuple(sorted(parts, key=lambda one: -one.size_bytes))

    def with_beginning(self, failed: Path, why: str, instead: Recording) -> "Found":
        """The same, with the beginning of a recording that gave nothing in its place."""
        own = Twin(failed, instead.path, GAVE_NOTHING.format(why=why))
        others = [
            replace(own, path=t.path) if t.why == SAME else replace(t, counted=instead.path)
            for t in self.twins
            if t.counted == failed and t.path != instead.path
        ]
        rest = [t for t in self.twins if t.counted != failed]
        counted = tuple(instead if one.path == failed else one for one in self.recordings)
        return Found(told_apart(counted), (own, *others, *rest), self.unreadable)


def find_recordings(
    words: Sequence[str], progress: Callable[[float, str], None] = lambda _done, _what: None
) -> Found:
    """The recordings that DIVES mean. Raises LogError for a word that means none.

    A dive folder is one recording; in any other folder each recording is one, and so on down. A table (.csv) that
    is not a dive folder's has to be named. A recording that was given before, by the SHA-256 of its unfolded bytes, is
    a twin; a dive folder comes before a file. So is one that is the beginning of another, which is the one that counts.
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
    told = [
        replace(cut[t.counted], path=t.path, recording=None) if t.counted in cut else t
        for t in (twins | cut).values()
    ]
    whole = tuple(one for one in recordings.values() if one.path not in cut)
    return Found(told_apart(whole), tuple(told), tuple(unreadable))


def told_apart(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """The recordings; those of one name with their folders before it, as many as tell them apart."""
    out = list(recordings)
    for depth in range(1, max((len(one.path.resolve().parts) for one in out), default=1) - 1):
        often = Counter(one.name for one in out)
        for k, one in enumerate(out):
            if often[one.name] > 1:
                folders = one.path.resolve().parts[-1 - depth : -1]
                out[k] = replace(one, name="/".join((*folders, name_of(one.path))))
    return tuple(out)


def _cut(recordings: Iterable[Recording]) -> list[Twin]:
    """Those that are the beginning of another recording, as a copy is that was cut or made before the dive's end."""
    alike: dict[str, list[Recording]] = {}
    for one in recordings:
        alike.setdefault(one.opening, []).append(one)
    alike.pop("", None)
    twins = []
    for group in alike.values():
        whole: list[tuple[Recording, bytes]] = []
        for one in sorted(group, key=lambda one: -one.size_bytes) if len(group) > 1 else ():
            data = contents(one.files)
            longer = next((other for other, held in whole if held.startswith(data)), None)
            if longer is None:
                whole.append((one, data))
            else:
                twins.append(Twin(one.path, longer.path, BEGINNING, one))
    return twins


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
