"""Falls back to a shorter copy of a recording when the longest copy gives no result."""

from collections.abc import Callable, Sequence
from pathlib import Path

from identify.batch.jobs import Recording, Result
from identify.batch.recordings import Found
from identify.batch.rows import rows_of

Work = Callable[[Sequence[Recording]], list[Result]]
"""Runs recordings and returns the result of each."""


def with_beginnings(found: Found, results: Sequence[Result], work: Work) -> tuple[Found, list[Result]]:
    """Replace each recording without a value by the longest of its shorter copies that gives a value.

    If no shorter copy gives a value, the recording stays, with the reason why it gave none. `results` are those of
    the recordings in `found`; `work` runs the shorter copies.
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
    """Reason why a result holds no value; empty if it holds at least one."""
    (row,) = rows_of([result])
    return "" if row.values else row.error
