"""The values of a parameter file and those last accepted, while there is no vehicle to compare the file with."""

import math
from functools import lru_cache
from pathlib import Path
from typing import Final

from bridge.errors import LogError, ParamError
from bridge.files import written_ns
from gcs_plugin.params.files import read_parameters
from gcs_plugin.params.last_accepted import accepted_of
from gcs_plugin.params.meaning import unit_of
from tui.app.drawing import SAME, Lines, lines_of, titled, wrapped
from tui.app.screens.parameters_table import UNITLESS, acting_number

HEADS: Final = ("name", "in the file", "last accepted", "unit")
Row = tuple[str, str, str, str]


def in_file(file: Path, receipts: Path, cells: int) -> Lines:
    """The lines of the file that differ from what was last accepted, and how many others there are.

    () if it can't be read: the reading of the vehicle has said so.
    """
    rows, others = _read(file, receipts, written_ns(file), written_ns(receipts))
    if not rows and not others:
        return ()
    lines = titled(f"{file.name} OF {file.absolute().parent.name}", "not compared with the vehicle", cells)
    widths = [max(map(len, column)) for column in zip(HEADS, *rows, strict=True)]
    # Where there is no room, units go.
    columns = len(HEADS) if sum(widths) + len(HEADS) <= cells else len(HEADS) - 1
    for row in (HEADS, *rows) if rows else ():
        texts = (_placed(n, text, widths[n]) for n, text in enumerate(row[:columns]))
        lines += (((" ".join(texts).rstrip(), "quiet" if row is HEADS else "plain"),),)
    if others:
        more = " more" if rows else ""
        lines += wrapped(f"{lines_of(others)}{more}, as last accepted or with no effect.", "quiet", cells)
    return lines


def _placed(n: int, text: str, cells: int) -> str:
    """The text of column `n`, a number at the right of its cells."""
    return f"{text:>{cells}}" if 0 < n < len(HEADS) - 1 else f"{text:<{cells}}"


@lru_cache(4)
def _read(file: Path, receipts: Path, *_changed_ns: int) -> tuple[tuple[Row, ...], int]:
    """The rows that differ, and the number of others."""
    try:
        wanted, known = read_parameters(file), accepted_of(file, receipts)
    except (ParamError, LogError):
        return (), 0
    rows = []
    for name, value in wanted.items():
        accepted = known[name].value if name in known else None
        if not math.isclose(value, accepted or 0.0, rel_tol=SAME):
            unit = unit_of(name)
            texts = acting_number(name, value), acting_number(name, accepted)
            rows.append((name, *texts, "" if unit == UNITLESS else unit))
    return tuple(rows), len(wanted) - len(rows)
