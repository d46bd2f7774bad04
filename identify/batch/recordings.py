"""The recordings that DIVES (files, folders, patterns) mean, each counted once; a shorter copy if the longest gives no
result.
"""

import glob
import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path

from bridge.errors import LogError
from identify.batch.jobs import Recording, Result
from identify.batch.rows import rows_of
from identify.ingest.open import contents, identity_of, recording_files

ENDINGS = (".tlog", ".tlog.gz", ".bin")
TABLE = ".csv"
DIVE_FILE = "telemetry."


class Relation(Enum):
    """Why a recording does not count beside its twin, worded to stand between their names."""

    SAME = "holds the same recording as"
    BEGINNING = "is the beginning of"
    REPLACED = "gave nothing ({reason}), so what counts is its beginning,"


@dataclass(frozen=True)
class Twin:
    """A recording at `path` that does not count, because that at `counted` holds the same dive.

    `recording` is the recording at `path` if it is the beginning of the longer recording, and so may count in its
    place; `reason` says why a longer one that is replaced gave nothing.
    """

    path: Path
    counted: Path
    relation: Relation
    recording: Recording | None = None
    reason: str = ""

    @property
    def why(self) -> str:
        """The relation in words, to stand between the two names."""
        return self.relation.value.format(reason=self.reason)


@dataclass(frozen=True)
class Found:
    """`recordings` to work on, each of a different dive; their `twins`; failed results for the `unreadable`."""

    recordings: tuple[Recording, ...]
    twins: tuple[Twin, ...]
    unreadable: tuple[Result, ...]

    def beginnings_of(self, path: Path) -> tuple[Recording, ...]:
        """Recordings that are a beginning of the one at `path`, longest first."""
        parts = (t.recording for t in self.twins if t.counted == path and t.recording is not None)
        return tuple(sorted(parts, key=lambda item: -item.size_bytes))

    def with_beginning(self, failed: Path, why: str, instead: Recording) -> "Found":
        """A copy in which the recording at `failed`, which gave nothing, is replaced by its beginning `instead`."""
        new_twin = Twin(failed, instead.path, Relation.REPLACED, reason=why)
        redirected = [
            replace(new_twin, path=t.path)
            if t.relation is Relation.SAME
            else replace(t, counted=instead.path)
            for t in self.twins
            if t.counted == failed and t.path != instead.path
        ]
        unrelated = [t for t in self.twins if t.counted != failed]
        counted = tuple(instead if recording.path == failed else recording for recording in self.recordings)
        return Found(told_apart(counted), (new_twin, *redirected, *unrelated), self.unreadable)


def find_recordings(
    words: Sequence[str], progress: Callable[[float, str], None] = lambda _done, _what: None
) -> Found:
    """Find the recordings that DIVES mean. Raises LogError for a word that matches none.

    A dive folder is a single recording; every other folder is searched for recordings, recursively. A table (.csv)
    outside a dive folder must be named itself. A recording with the same SHA-256 of its uncompressed bytes as an
    earlier recording is a twin; dive folders come before files. So is the beginning of a longer recording; the longer
    recording counts.
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
            twins[path] = Twin(path, recordings[known_by.sha256].path, Relation.SAME)
        else:
            recordings[known_by.sha256] = Recording(name_of(path), path, files, **vars(known_by))
    cut = {twin.path: twin for twin in _cut(recordings.values())}
    all_twins = [
        replace(cut[t.counted], path=t.path, recording=None) if t.counted in cut else t
        for t in (twins | cut).values()
    ]
    complete = tuple(recording for recording in recordings.values() if recording.path not in cut)
    return Found(told_apart(complete), tuple(all_twins), tuple(unreadable))


def told_apart(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
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
        complete: list[tuple[Recording, bytes]] = []
        for recording in sorted(group, key=lambda item: -item.size_bytes) if len(group) > 1 else ():
            data = contents(recording.files)
            longer = next((longer_one for longer_one, held in complete if held.startswith(data)), None)
            if longer is None:
                complete.append((recording, data))
            else:
                twins.append(Twin(recording.path, longer.path, Relation.BEGINNING, recording))
    return twins


def name_of(path: Path) -> str:
    """Name of a recording: that of its folder or file, without the file ending."""
    name = path.resolve().name
    for ending in (*ENDINGS[::-1], TABLE):
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
    if not recordings:
        raise LogError(f"{word}: {nothing}")
    return recordings


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


Work = Callable[[Sequence[Recording]], list[Result]]
"""Runs recordings and returns the result of each."""


def with_beginnings(recordings: Found, results: Sequence[Result], work: Work) -> tuple[Found, list[Result]]:
    """Replace each recording without a value by the longest of its shorter copies that gives a value.

    If no shorter copy gives a value, the recording stays, with the reason why it gave none. `results` are those of
    the recordings in `found`; `work` runs the shorter copies.
    """
    by_source = {result.source: result for result in results}
    left = {}
    for source, result in by_source.items():
        reason, beginnings = _nothing(result), list(recordings.beginnings_of(Path(source)))
        if reason and beginnings:
            left[source] = reason, beginnings
    while left:
        tried = {source: parts.pop(0) for source, (_, parts) in left.items()}
        came = {result.source: result for result in work(list(tried.values()))}
        for source, part in tried.items():
            result, (why, parts) = came[str(part.path)], left[source]
            if not _nothing(result):
                recordings = recordings.with_beginning(Path(source), why, part)
                by_source[source] = result
            if not parts or not _nothing(result):
                del left[source]
    return recordings, list(by_source.values())


def _nothing(result: Result) -> str:
    """Reason why a result holds no value; empty if it holds at least one."""
    (row,) = rows_of([result])
    return "" if row.values else row.error
