"""Finds the time column of a log: a rising column with a name of time, otherwise one whose values rise evenly."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bridge.arrays import Array
from bridge.errors import LogError
from identify.ingest.files.clock import MOST_WRONG, iso_s
from identify.ingest.files.streams import Stream
from identify.ingest.mapping.column_map import ISO, OF_DAY, TimeColumn
from identify.ingest.mapping.names import ends_in_time_unit, long_time_unit, snake, time_unit
from identify.ingest.mapping.ranges import time_unit_of
from identify.ingest.ros.recorded import RECEIVED, STAMP
from identify.words import listed

LEAST_RISING = 0.95
"""Least share of steps of a time that do not fall."""

FEWEST_EQUAL, EQUAL_WITHIN = 20, 0.01
"""A column without a name of time is taken as time if it has so many steps that are equal to this share."""

TIME_FIRST = ("field_header_stamp", "header_stamp", "stamp", "timestamp", "time", "t")
"""Names of a time, the most telling first: `rostopic echo -p` writes when it got a message as `time`, and what is in
the message as `field`."""
LEAST_STEP_S = 2e-5
"""Mean step of rows that no logger writes faster: in days, rows at 20 Hz are 6e-7 apart."""
COARSEST_FIRST = ("s", "ms", "us", "ns")


def time_column(streams: Sequence[Stream], path: Path) -> tuple[TimeColumn, str]:
    """The time column of most streams, with its unit, and the reason if its name doesn't say."""
    counts: dict[str, int] = {}
    for stream in streams:
        for field in (*stream.columns, *stream.text):
            is_time, _ = time_unit(field)
            if is_time and (field in stream.text or _rises(stream.columns[field])):
                counts[field] = counts.get(field, 0) + 1
    if not any(len(cells) for stream in streams for cells in stream.columns.values()):
        raise LogError("holds no rows of numbers; give a log with samples", path)
    if not counts:
        return _unnamed(streams, path)

    def worth(field: str) -> tuple[int, int]:
        plain = snake(field)
        return counts[field], -TIME_FIRST.index(plain) if plain in TIME_FIRST else -len(TIME_FIRST)

    column = max(counts, key=worth)
    back = [s.name for s in streams if STAMP in s.columns and _falls_back(s.columns[STAMP])]
    if column == RECEIVED and back:
        return TimeColumn(RECEIVED, "s"), (
            f"The header times of {listed(back)} fall back from message to message, so the log's are taken, which are "
            f"later by what the way takes; if messages only overtook each other, '{STAMP}' is right."
        )
    unit = "s" if any(column in stream.dates for stream in streams) else time_unit(column)[1]
    values = [stream.columns[column] for stream in streams if column in stream.columns]
    if not values:
        return TimeColumn(column, ISO), ""
    if unit:
        return TimeColumn(column, unit), ""
    longest = max(values, key=len)
    if _is_time_of_day(longest):
        return _of_day(column)
    unit, is_telling = time_unit_of(longest)
    known = longest[np.isfinite(longest)]
    if unit == "s" and len(known) > 1 and 0 < (step := np.ptp(known) / (len(known) - 1)) < LEAST_STEP_S:
        raise LogError(
            f"its times in '{column}' go on by {step:.2g} from row to row, too little for seconds; if they are days, "
            "as spreadsheets and MATLAB count them, give them in s",
            path,
        )
    return TimeColumn(
        column, unit
    ), "" if is_telling else f"By the steps of '{column}', its unit is {unit}; check it."


def _unnamed(streams: Sequence[Stream], path: Path) -> tuple[TimeColumn, str]:
    """The time column where none that rises is named a time, and the reason. Raises LogError without any."""
    names = sorted({field for stream in streams for field in stream.columns})
    if long := [name for name in names if long_time_unit(name)]:
        raise LogError(
            f"its times in '{long[0]}' are in {long_time_unit(long[0])}; give them in s, ms, us or ns", path
        )
    back = [name for name in names if time_unit(name)[0]]
    if back and (still := _of_one_moment(streams, back[0])):
        raise LogError(still, path)
    if back:
        raise LogError(
            f"its times in '{back[0]}' do not rise, as where several runs stand in one table; give each "
            "run a file of its own, or a column with its number",
            path,
        )
    dates = [field for stream in streams for field, words in stream.text.items() if _are_dates(words)]
    if dates:
        return TimeColumn(dates[0], ISO), f"No column is named a time; '{dates[0]}' holds dates."
    rising = [
        (-_evenness(stream.columns[field]), COARSEST_FIRST.index(unit), field)
        for stream in streams
        for field in stream.columns
        if (unit := ends_in_time_unit(field)) and _rises(stream.columns[field])
    ]
    if rising:
        # Of names for m/s, some end as milliseconds do.
        _, coarseness, field = min(rising, key=lambda each: each[:2])
        unit = COARSEST_FIRST[coarseness]
        reason = f"No column is named a time; '{field}' rises throughout, and ends in {unit}."
        return TimeColumn(field, unit), reason
    even = [
        field
        for stream in streams
        for field, cells in stream.columns.items()
        if _rises(cells) and _has_equal_steps(cells)
    ]
    if even:
        longest = max((stream.columns[even[0]] for stream in streams if even[0] in stream.columns), key=len)
        unit, _ = time_unit_of(longest)
        reason = f"No column is named a time; '{even[0]}' rises by equal steps throughout: taken for {unit}."
        return TimeColumn(even[0], unit), reason
    raise LogError(
        f"no column is a rising time ({', '.join(names[:12])}); name one `time`, in seconds, or write the column "
        "map by hand, as docs/howto/bring_your_own_log.md shows",
        path,
    )


def _are_dates(words: Sequence[str]) -> bool:
    """Whether a column of words holds times that rise, as ISO 8601 writes them."""
    try:
        return _rises(iso_s(words))
    except ValueError:
        return False


def _of_one_moment(streams: Sequence[Stream], time: str) -> str:
    """Fault of a file in which time stands still, and the remedy; "" if time passes in a stream."""
    clocks = [stream.columns[time] for stream in streams if time in stream.columns]
    if any(np.ptp(known) > 0 for cells in clocks if len(known := cells[np.isfinite(cells)])):
        return ""
    rows = max(map(len, clocks))
    if rows < 2:
        held = "one message of each topic" if streams[0].name else "one row alone"
        return f"holds {held}, and a motion takes many; if it was cut short, give the whole recording"
    return f"its clock '{time}' stands still in all {rows} rows; name the column that is the time `time`, in seconds"


def of_day(streams: Sequence[Stream], time: TimeColumn) -> tuple[TimeColumn, str] | None:
    """The time column of several runs if it is the time of day, and the reason; one run may be too short to tell."""
    clocks = [stream.columns[time.column] for stream in streams if time.column in stream.columns]
    if not clocks or time_unit(time.column)[1] or not all(map(_is_time_of_day, clocks)):
        return None
    return _of_day(time.column)


def _of_day(column: str) -> tuple[TimeColumn, str]:
    return TimeColumn(column, OF_DAY), f"'{column}' counts to 59 and on from 100, so it is the time of day."


def _is_time_of_day(time: Array) -> bool:
    """Whether times are hours, minutes and seconds as one number, which steps from 59 to 100."""
    known = time[np.isfinite(time)]
    sixty = known[(known % 100 < 60) & (known // 100 % 100 < 60)]
    if len(known) - len(sixty) > MOST_WRONG * len(known):
        return False
    return bool((sixty == np.rint(sixty)).all() and np.isin(np.diff(sixty), (41, 4041)).any())


def _rises(time: Array) -> bool:
    known = time[np.isfinite(time)]
    steps = np.diff(known)
    return len(steps) > 0 and float(np.mean(steps >= 0)) >= LEAST_RISING and known[-1] > known[0]


def _has_equal_steps(cells: Array) -> bool:
    """Whether a column (n,) rises as a clock of steady rows does, and does not number the rows."""
    steps = np.diff(cells)
    if len(steps) < FEWEST_EQUAL or not np.isfinite(steps).all():
        return False
    step = float(np.median(steps))
    return step not in (0.0, 1.0) and bool((np.abs(steps - step) <= EQUAL_WITHIN * step).all())


def _falls_back(time: Array) -> bool:
    """Whether times fall so often that they do not rise; times that stand still, or a single one, fall nowhere."""
    return not _rises(time) and bool(np.any(np.diff(time[np.isfinite(time)]) < 0))


def _evenness(time: Array) -> float:
    """Share of the steps of rising times (n,) that are the usual one or nearly, in tenths: clocks stumble at times."""
    steps = np.diff(time[np.isfinite(time)])
    usual = float(np.median(steps))
    return round(float(np.mean(np.abs(steps - usual) < 0.5 * usual)), 1)
