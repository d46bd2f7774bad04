"""Reads a table in a `.parquet` file."""

from pathlib import Path

import numpy as np

from bridge.errors import LogError
from identify.ingest.files.optional_libraries import library
from identify.ingest.files.streams import Stream, Streams, as_numbers, some_of

EXTRA = "tables"


def read_parquet(path: Path) -> Streams:
    """The table in a file: numbers, dates in Unix s, words; fields of a struct are named `STRUCT.FIELD`.

    Lists and other values that are neither number, date nor word are left out. Raises LogError.
    """
    parquet, arrow = library("pyarrow.parquet", EXTRA, path), library("pyarrow", EXTRA, path)
    try:
        table = parquet.read_table(path)
    except (arrow.ArrowException, OSError, ValueError):
        raise LogError("is cut off or no Parquet file; write it again", path) from None
    while any(arrow.types.is_struct(part.type) for part in table.schema):
        table = table.flatten()
    if not table.num_rows:
        raise LogError("holds no rows; give a table with a row for each sample", path)
    columns, text, empty, left_out, dates = {}, {}, {}, [], set()
    types = arrow.types
    for name, column in zip(table.column_names, table.columns, strict=True):
        if types.is_dictionary(column.type):
            column = column.cast(column.type.value_type)
        if types.is_string(column.type) or types.is_large_string(column.type):
            text[name] = tuple(word or "" for word in column.to_pylist())
            continue
        if types.is_decimal(column.type) or types.is_boolean(column.type):
            column = column.cast(arrow.float64() if types.is_decimal(column.type) else arrow.uint8())
        is_number = types.is_primitive(column.type) and not types.is_time(column.type)
        numbers = as_numbers(column.to_numpy()) if is_number else None
        if numbers is None:
            left_out.append(name)
            continue
        nothing = column.is_null().to_numpy()
        if nothing.any():
            numbers[nothing] = np.nan
            empty[name] = nothing
        columns[name] = numbers
        if not types.is_integer(column.type) and not types.is_floating(column.type):
            dates.add(name)
    notes = (f"Not read, as they are no columns of numbers: {some_of(left_out)}.",) if left_out else ()
    return Streams((Stream("", columns, text, frozenset(dates)),), notes, empty)
