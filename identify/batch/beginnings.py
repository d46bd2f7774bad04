"""A longer copy that gives nothing does not swallow its beginning: that is identified in its place."""

from collections.abc import Callable, Sequence
from pathlib import Path

from identify.batch.jobs import Recording, Result
from identify.batch.recordings import Found
from identify.batch.rows import rows_of

Work = Callable[[Sequence[Recording]], list[Result]]
"""What comes of recordings, each one's result."""


def with_beginnings(found: Found, results: Sequence[Result], work: Work) -> tuple[Found, list[Result]]:
    """In place of each recording that gave nothing the longest of its beginnings that gives something.

    Where none does, the recording stays, and why it gave nothing.
    """
    by_source = {result.source: result for result in results}
    left = {}
    for source, result in by_source.items():
        reason, beginnings = _nothing(result), list(found.beginnings_of(Path(source)))
        if reason and beginnings:
            left[source] = reason, beginnings
    while left:
        tried = {source: parts.pop(0) for source, (_, parts) in left.items()}
        came = {result.source: result for result in work(list(tried.values()))}
        for source, part in tried.items():
            result, (why, parts) = came[str(part.path)], left[source]
            if not _nothing(result):
                found = found.with_beginning(Path(source), why, part)
                by_source[source] = result
            if not parts or not _nothing(result):
                del left[source]
    return found, list(by_source.values())


def _nothing(result: Result) -> str:
    """Why a result holds no value; empty where it holds one."""
    (row,) = rows_of([result])
    return "" if row.values else row.error
