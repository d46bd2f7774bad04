"""Output of the verbs: tables, sentences and questions for people, progress while they wait, JSON for programs.

Results go to standard output, everything else to standard error; if `--json -` claims standard output, the tables go
to standard error as well.
"""

import errno
import io
import math
import os
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from textwrap import indent
from typing import TYPE_CHECKING, Any, TextIO, cast

import rich.table
from rich.box import Box
from rich.console import Console, ConsoleOptions, RenderableType
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.segment import Segment

from bridge import reports
from bridge.clock import Clock, SystemClock
from bridge.errors import LogError
from bridge.exit_codes import UsageError
from bridge.files import write_whole
from bridge.plain import to_json
from bridge.reports import Report, Written
from bridge.text import MARK, printable, wrapped
from identify.progress import NO_VALUES, Steps, Values
from identify.words import MINUS, significant, with_units

if TYPE_CHECKING:
    from gcs_plugin.params.client import ParameterClient

STANDARD_OUTPUT = "-"
LINE_EVERY_S = 5.0
PIPED_WIDTH = 160
BETWEEN_COLUMNS = "  "
RULE = Box("    \n    \n ── \n    \n    \n    \n    \n    \n")
"""Nothing but a rule below the headings."""
LONGEST_WORD = 20
"""Longer words of a heading or of the last column may be broken."""


@dataclass(frozen=True)
class Tell:
    """Reports the progress of a job: `of` is its name for a program, and `shows` takes its reports."""

    of: str
    shows: Callable[[Report], None]

    def __call__(
        self,
        share: float,
        words: str,
        values: Values = NO_VALUES,
        answered: bool = False,
        *,
        stage: str = "",
        written: Written | None = None,
    ) -> None:
        """Report the share that is done (0 to 1), the present work in words, and all else as in `Report`."""
        self.shows(Report(self.of, share, words, stage, dict(values), answered, written))


class _HarmlessConsole(Console):
    """A console on which no text can steer the terminal, whatever its origin: only the console's own styles do."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        for segment in super().render(renderable, options):
            yield segment if segment.control else segment._replace(text=harmless(segment.text))


class _Stream(io.TextIOBase):
    """Standard output or standard error. Where its terminal has gone away, nobody reads it, and what runs goes on.

    On standard error it also goes on where a pipe is closed, or the disk that keeps the words is full.
    """

    def __init__(self, *, to_errors: bool) -> None:
        self._to_errors = to_errors

    @property
    def _standard(self) -> TextIO:
        stream = sys.stderr if self._to_errors else sys.stdout
        # While a line of progress is shown, rich puts a stream of its own there, which leads back to the console.
        return cast(TextIO, getattr(stream, "rich_proxied_file", stream))

    @property
    def encoding(self) -> str:  # type: ignore[override]
        return self._standard.encoding

    def isatty(self) -> bool:
        return self._standard.isatty()

    def fileno(self) -> int:
        return self._standard.fileno()

    def write(self, text: str) -> int:
        with self._unless_gone():
            self._standard.write(text)
        return len(text)

    def flush(self) -> None:
        with self._unless_gone():
            self._standard.flush()

    @contextmanager
    def _unless_gone(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            if not self._to_errors and error.errno != errno.EIO:
                raise


def harmless(text: str) -> str:
    """`text` with a mark for each character that could steer a terminal; line breaks are kept."""
    return printable(text, MARK, "\n\t")


def results(json_target: str | None = None) -> Console:
    return _console(to_errors=json_target == STANDARD_OUTPUT)


def words() -> Console:
    """Console for all output except results: notes, questions, progress."""
    return _console(to_errors=True)


def _console(*, to_errors: bool) -> Console:
    # Closed from the start (`>&-`) it is None, and rich then writes nowhere.
    closed = (sys.stderr if to_errors else sys.stdout) is None
    stream = None if closed else cast(TextIO, _Stream(to_errors=to_errors))
    console = _HarmlessConsole(file=stream, stderr=to_errors, highlight=False, emoji=False, markup=False)
    if not _has_width(console):
        console.width = PIPED_WIDTH
    return console


def _has_width(console: Console) -> bool:
    """Whether lines have a certain width: at a terminal, or set by COLUMNS."""
    return console.is_terminal or os.environ.get("COLUMNS", "").isdigit()


def asked(client: "ParameterClient", question: str, to_do: str) -> str:
    """Return the answer typed. Raises UsageError if stdin is no terminal; `to_do` names the effect of --yes."""
    if not sys.stdin.isatty():
        raise UsageError(
            f"nobody to ask, standard input is no terminal; give --yes to {to_do} without asking"
        )
    print(harmless(question), end="", file=sys.stderr, flush=True)
    with _listening(client):
        return sys.stdin.readline().strip()


def agreed(client: "ParameterClient", question: str, to_do: str) -> bool:
    """Whether the user types yes. Raises as `asked`."""
    return asked(client, f"{question} [yes/no] ", to_do).lower() in ("y", "yes")


@contextmanager
def _listening(client: "ParameterClient") -> Iterator[None]:
    """Keep reading the link meanwhile: otherwise old data passes for new later, or a hub drops this program as slow."""
    stop = threading.Event()
    thread = threading.Thread(target=client.listen, args=(stop,), name="listen", daemon=True)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


def say(console: Console, *sentences: str) -> None:
    """Print each sentence, wrapped between words if lines have a width; a longer word, such as a path, stays whole.

    Every line is as far in as the sentence begins, so that an indented one stands out as a whole.
    """
    for sentence in sentences:
        console.print(_lines_of(sentence, console.width) if _has_width(console) else sentence, soft_wrap=True)


GLUE = "\N{NARROW NO-BREAK SPACE}"


def _lines_of(sentence: str, width: int) -> str:
    """The sentence in lines, with every number on the line of its unit."""
    margin = " " * (len(sentence) - len(sentence.lstrip(" ")))
    whole = with_units(sentence.removeprefix(margin), GLUE)
    return indent(wrapped(whole, width - len(margin)), margin).replace(GLUE, " ")


@dataclass(frozen=True)
class Table:
    """A table of text; the columns named in `numbers` are aligned right, the last column may wrap.

    `stale`: for each row whether a terminal dims it; none if empty.
    """

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    numbers: Sequence[str] = ()
    stale: Sequence[bool] = ()

    def widths(self, width: int) -> list[int]:
        """The width of each column for lines of `width`: cells stay whole, except the words of the last column.

        Headings wrap over several lines if there is no room for them. A table that does not fit is wider.
        """
        cells = [max((len(row[i]) for row in self.rows), default=0) for i in range(len(self.columns))]
        room = width - len(BETWEEN_COLUMNS) * (len(cells) - 1)
        whole = [max(cell, len(heading), 1) for cell, heading in zip(cells, self.columns, strict=True)]
        if sum(whole) <= room:
            return whole
        needed = [max(cell, _longest_word(h), 1) for cell, h in zip(cells, self.columns, strict=True)]
        least = max(_longest_word(text) or 1 for text in (self.columns[-1], *(row[-1] for row in self.rows)))
        return [*needed[:-1], max(min(whole[-1], room - sum(needed[:-1])), least)]

    def drawn(self, width: int) -> rich.table.Table:
        shape = rich.table.Table(
            box=RULE, show_edge=False, pad_edge=False, padding=(0, 1, 0, 0), header_style=""
        )
        for heading, cells in zip(self.columns, self.widths(width), strict=True):
            right = heading in self.numbers
            shape.add_column(
                harmless(heading), width=cells, justify="right" if right else "left", overflow="fold"
            )
        for row, stale in zip_longest(self.rows, self.stale):
            shape.add_row(*map(harmless, row), style="dim" if stale else "")
        return shape

    def lines(self, width: int) -> list[str]:
        """Headings, a rule and the rows."""
        whole = max(width, sum(self.widths(width)) + len(BETWEEN_COLUMNS) * (len(self.columns) - 1))
        page = Console(file=io.StringIO(), width=whole, markup=False, emoji=False, highlight=False)
        with page.capture() as drawn:
            page.print(self.drawn(width))
        return [line.rstrip() for line in drawn.get().splitlines()]


def put(console: Console, shown: Table) -> None:
    """Print a table with an empty line after it, never with a cell cut."""
    if shown.title:
        console.print(wrapped(shown.title, console.width), style="bold", soft_wrap=True)
    console.print("\n".join(shown.lines(console.width)) + "\n", soft_wrap=True)


def _longest_word(text: str) -> int:
    return min(max(map(len, text.split()), default=0), LONGEST_WORD)


def number(value: float | None, digits: int = 4) -> str:
    """A number to so many significant digits; `-` if it is None or not finite."""
    if value is None or not math.isfinite(value):
        return "-"
    return significant(value, digits).replace(MINUS, "-")


@dataclass(frozen=True)
class _Job:
    """A job whose progress is shown: `of` is its name for a program, `sentence` is shown until it reports, and `prefix`
    stands before its words."""

    of: str
    sentence: str
    prefix: str = ""

    def words(self, report: Report) -> str:
        if not report.words:
            return self.sentence
        fitted = ", ".join(
            f"{name} {number(value)} ± {number(half, 2)}" for name, (value, half) in report.values.items()
        )
        fitted = fitted or ("no value" if report.answered else "")
        return f"{self.prefix}{report.words}{': ' if fitted else ''}{fitted}"


@contextmanager
def progress(sentence: str) -> Iterator[Tell]:
    """Show progress on standard error: call the function yielded with the fraction done and a sentence.

    A bar on a terminal, elsewhere a line every few seconds.
    """
    with _shown((_Job(sentence, sentence),)) as (tell,):
        yield tell


@contextmanager
def steps(sentence: str) -> Iterator[Steps]:
    """As `progress`, for work that reports by steps."""
    with progress(sentence) as tell:
        yield lambda step: tell(step.share, step.words)


@contextmanager
def bars(jobs: Mapping[str, str]) -> Iterator[Steps]:
    """Progress of several jobs at once, each shown as by `progress`; may be called from different threads.

    `jobs`: the sentence that each shows at first, by its name, which begins each of its lines. Of several jobs, each
    reports its end.
    """
    with _shown([_Job(name, sentence, f"{name}: ") for name, sentence in jobs.items()]) as tells:
        tell_of = dict(zip(jobs, tells, strict=True))
        yield lambda step: tell_of[step.of](step.share, step.words, step.values, step.answered)


@contextmanager
def _shown(jobs: Sequence[_Job]) -> Iterator[tuple[Tell, ...]]:
    """A program that reads the progress asks for lines of JSON by an environment variable (`bridge.reports`)."""
    console = words()
    if reports.asked(os.environ):
        yield tuple(Tell(job.of, tell_program) for job in jobs)
        return
    if not console.is_terminal:
        among = len(jobs) > 1
        yield tuple(Tell(job.of, _lines(console, job, SystemClock(), among_others=among)) for job in jobs)
        return
    shown = Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
        console=console,
        transient=True,
    )
    with shown:
        yield tuple(Tell(job.of, _bar(shown, job)) for job in jobs)


def tell_program(report: Report) -> None:
    """Write a report for the program that reads the progress."""
    # A single write per line, since several threads may report at once. A verb goes on when its listener is gone.
    with suppress(BrokenPipeError):
        sys.stderr.write(reports.line(report))
        sys.stderr.flush()


def _bar(shown: Progress, job: _Job) -> Callable[[Report], None]:
    task = shown.add_task(job.sentence, total=1.0)
    return lambda report: shown.update(task, completed=report.share, description=job.words(report))


def _lines(console: Console, job: _Job, clock: Clock, *, among_others: bool) -> Callable[[Report], None]:
    """Print a job's words and share every few seconds at most; one among others when it ends, and once a tenth."""
    printed_s, tenth = clock.boot_s(), 0

    def show(report: Report) -> None:
        nonlocal printed_s, tenth
        reached, is_due = int(10 * report.share + 1e-9), clock.boot_s() - printed_s >= LINE_EVERY_S
        if (reached > tenth and (report.share >= 1.0 or is_due)) if among_others else is_due:
            printed_s, tenth = clock.boot_s(), reached
            words = job.words(report)
            line = f"{words} ({report.share:.0%})" if among_others else f"{report.share:4.0%} {words}"
            console.print(line, soft_wrap=True)

    return show


def replace_file(path: Path, text: str) -> None:
    """Write `text` to `path`; if that fails, a file that was there stays unchanged. Raises OSError.

    A path that is no plain file, such as a pipe, or whose folder takes no new file, is written in place.
    """
    path = path.resolve()
    if (path.exists() and not path.is_file()) or not os.access(path.parent, os.W_OK):
        path.write_text(text, encoding="utf-8", errors="replace")
        return
    write_whole(path, text, synced=True)


def write_json(data: Any, target: str | None) -> None:
    """Write `data` as JSON to a file, completely or not at all, or to standard output for `-`; do nothing for None.

    Raises LogError if the file can't be written.
    """
    if target is None:
        return
    write_text(to_json(data, indent=2) + "\n", target, "the JSON ")


def write_text(text: str, target: str, content: str = "") -> None:
    """Write `text` to a file, completely or not at all; for `-` to standard output, without control characters.

    Raises LogError if the file can't be written; `content` begins its message.
    """
    if target == STANDARD_OUTPUT:
        sys.stdout.write(harmless(text))
        return
    try:
        replace_file(Path(target), text)
    except OSError as error:
        raise LogError(f"{target}: {content}can't be written ({error.strerror}); give another file") from None
