"""What a verb shows: tables and sentences for people, progress while they wait, JSON for programs.

Results go to standard output, everything else to standard error; where `--json -` claims standard output,
the tables follow to standard error.
"""

import json
import math
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from bridge.clock import Clock, SystemClock
from bridge.errors import LogError

Tell = Callable[[float, str], None]

STANDARD_OUTPUT = "-"
LINE_EVERY_S = 5.0


def results(json_target: str | None = None) -> Console:
    """Where tables go."""
    return _console(to_errors=json_target == STANDARD_OUTPUT)


def words() -> Console:
    """Where everything goes that is no result: notes, questions, progress."""
    return _console(to_errors=True)


def _console(*, to_errors: bool) -> Console:
    console = Console(stderr=to_errors, highlight=False, emoji=False, markup=False)
    if not console.is_terminal:
        console.width = 160
    return console


def table(
    title: str, columns: Sequence[str], rows: Sequence[Sequence[str]], numbers: Sequence[str] = ()
) -> Table:
    """A table of text; the columns named in `numbers` are set flush right, the last may wrap."""
    shown = Table(title=title, title_justify="left", title_style="bold", box=SIMPLE_HEAD, pad_edge=False)
    for column in columns:
        right = column in numbers
        shown.add_column(column, justify="right" if right else "left", no_wrap=column != columns[-1])
    for row in rows:
        shown.add_row(*row)
    return shown


def number(value: float | None, digits: int = 4) -> str:
    """A number to so many significant digits; `-` for one that does not exist."""
    if value is None or not math.isfinite(value):
        return "-"
    if value == 0:
        return "0"
    rounded = float(f"{value:.{digits}g}")
    places = digits - 1 - math.floor(math.log10(abs(rounded)))
    return f"{rounded:.{min(max(places, 0), 9)}f}"


@contextmanager
def progress(sentence: str) -> Iterator[Tell]:
    """Progress on standard error: call what it gives with a fraction done and a sentence.

    A bar on a terminal, elsewhere a line every few seconds.
    """
    console = words()
    if not console.is_terminal:
        yield _lines(console, sentence, SystemClock())
        return
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
        console=console,
        transient=True,
    )
    with bar:
        task = bar.add_task(sentence, total=1.0)

        def tell(done: float, what: str) -> None:
            bar.update(task, completed=done, description=what or sentence)

        yield tell


def _lines(console: Console, sentence: str, clock: Clock) -> Tell:
    told_s = clock.boot_s()

    def tell(done: float, what: str) -> None:
        nonlocal told_s
        if clock.boot_s() - told_s >= LINE_EVERY_S:
            told_s = clock.boot_s()
            console.print(f"{done:4.0%} {what or sentence}", soft_wrap=True)

    return tell


def write_json(data: Any, target: str | None) -> None:
    """Write `data` as JSON to a file, or to standard output for `-`; nothing where `target` is None.

    Raises LogError where the file can't be written.
    """
    if target is None:
        return
    text = json.dumps(plain(data), indent=2, allow_nan=False) + "\n"
    if target == STANDARD_OUTPUT:
        sys.stdout.write(text)
        return
    try:
        Path(target).write_text(text, encoding="utf-8")
    except OSError as error:
        raise LogError(f"{target}: the JSON can't be written ({error.strerror}); give another file") from None


def plain(data: Any) -> Any:
    """`data` with numbers that do not exist as null and paths as text."""
    if isinstance(data, dict):
        return {str(key): plain(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [plain(value) for value in data]
    if isinstance(data, float) and not math.isfinite(data):
        return None
    return str(data) if isinstance(data, Path) else data
