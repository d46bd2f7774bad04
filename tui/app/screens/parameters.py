"""Parameters: the vehicle beside what was identified and what was last accepted; upload and roll back, by typing."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import ClassVar, Final

from textual import events
from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.widgets import Input

from gcs_plugin.watch.picture import Armed
from tui.app import parameter_lines as lines
from tui.app.actions import Action, bindings
from tui.app.comparison import ACTING, Comparison, Entry, comparison
from tui.app.confirming import agrees, needed
from tui.app.header import Tab
from tui.app.jobs import JobState
from tui.app.lines import Lines
from tui.app.screens.frame import StationScreen
from tui.app.view import View
from tui.app.widgets.drawn import Drawn
from tui.app.wrapped import wrapped

READ, WRITE = "params diff", "params upload"
"""The jobs: what reads and compares, and what writes, be it an upload or a roll back."""
IDENTIFIED: Final = "identified.param"
OLD_S: Final = 120.0
"""What the vehicle held so long ago may have changed since: it is read anew before anything is asked."""


class ParameterTable(Drawn):
    """The table; a click goes to a line, one on the line itself chooses it."""

    def on_click(self, event: events.Click) -> None:
        screen = self.screen
        assert isinstance(screen, ParametersScreen)
        screen.click(event.y, self.size.height)


class ParametersScreen(StationScreen):
    """The table above, what is to be known of a line and what is asked below."""

    ACTIONS: ClassVar[tuple[Action, ...]] = (
        Action(
            "parameters.choose",
            "space",
            "choose",
            "Choose",
            "write this line, or leave it as it is",
            looks=True,
        ),
        Action("parameters.all", "a", "all", "All", "choose all lines that change, or none", looks=True),
        Action("parameters.upload", "u", "upload", "Upload", "write the chosen lines; asks for their number"),
        Action(
            "parameters.back", "r", "back", "Roll back", "the values before the last upload; asks likewise"
        ),
        Action("parameters.read", "ctrl+r", "read", "Read", "read the vehicle again", in_footer=False),
        Action("parameters.up", "up,k", "go(-1)", "Up", "the line above", in_footer=False, looks=True),
        Action("parameters.down", "down,j", "go(1)", "Down", "the line below", in_footer=False, looks=True),
        Action(
            "parameters.first", "home", "go(-1000)", "First", "the first line", in_footer=False, looks=True
        ),
        Action("parameters.last", "end", "go(1000)", "Last", "the last line", in_footer=False, looks=True),
    )
    BINDINGS = bindings(ACTIONS)  # type: ignore[assignment]
    LEGEND: ClassVar[tuple[tuple[str, str], ...]] = (
        (f"{lines.CHOSEN} {lines.LEFT}", "a line that changes: to be written, or left as it is"),
        (lines.DOUBT, "the value is doubted; the line below the table says why"),
        (
            lines.IN_HALVES,
            "the change in halves of the 95 % interval: 1 and less is within it, over 3 is worth a second look",
        ),
        ("accepted", "what was last uploaded and read back, and not rolled back since"),
    )

    def __init__(self, title: str, tabs: Sequence[Tab]) -> None:
        super().__init__(title, tabs)
        self._shown: Comparison | None = None
        self._chosen: set[str] = set()
        self._at = 0
        self._going_back = self._asks_once_read = self._asking = False
        self._trouble = ""
        self._read_of: tuple[Path, int] | None = None
        self._taken: JobState | None = None
        self._written: JobState | None = None
        self._offered: object = None

    def body(self) -> ComposeResult:
        yield Drawn(self._top, id="parameters-top")
        with Horizontal(id="parameters"):
            yield ParameterTable(self._table, id="parameters-table")
            with VerticalScroll(id="parameters-scroll", can_focus=False):
                yield Drawn(self._below, id="parameters-below")
        with Vertical(id="parameters-ask"):
            yield Drawn(self._question, id="parameters-question")
            yield Input(id="parameters-typed", placeholder="", select_on_focus=False)

    def on_screen_resume(self) -> None:
        unseen = self._written is not None and self._written.done is None
        if not self._asking and not unseen:
            self._read_anew(back=False)

    def show(self, view: View) -> None:
        self._take_read()
        self._take_written()
        offered = (self._asking, self.desk.jobs.runs(READ), self.desk.jobs.runs(WRITE), self._shown)
        if offered != self._offered:
            self._offered = offered
            self.refresh_bindings()
        super().show(view)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        writes = self.desk.jobs.runs(WRITE)
        if action in ("choose", "all"):
            return self._shown is not None and not (self._asking or writes or self._going_back)
        if action in ("upload", "back", "read"):
            return not (self._asking or writes)
        return super().check_action(action, parameters)

    def close_up(self) -> None:
        """Ask no longer; after that, go back from a roll back to the file."""
        if self._asking:
            self._ask(False)
        elif self._going_back and not self.desk.jobs.runs(WRITE):
            self._read_anew(back=False)

    def action_go(self, rows: int) -> None:
        if self._shown is not None:
            self._at = max(0, min(self._at + rows, len(self._shown.entries) - 1))
            self._draw()

    def click(self, y: int, rows: int) -> None:
        """A click on that line of a table of so many."""
        entries = self._shown.entries if self._shown is not None else ()
        entry = lines.entry_at(y, len(entries), self._at, rows)
        if entry is None:
            return
        if entry == self._at and self.check_action("choose", ()):
            self.action_choose()
        self._at = entry
        self._draw()

    def action_choose(self) -> None:
        entry = self._entry()
        if entry is not None and entry.changes:
            self._chosen ^= {entry.name}
            self._draw()

    def action_all(self) -> None:
        if self._shown is not None:
            everything = set(self._shown.changed)
            self._chosen = set() if self._chosen == everything else everything
            self._draw()

    def action_read(self) -> None:
        self._read_anew(back=self._going_back)

    def action_upload(self) -> None:
        """Ask for the confirmation; first read what is being read, or what is old."""
        self._trouble = ""
        if self._going_back or self._is_old():
            self._read_anew(back=False)
        self._ask_once_read()

    def action_back(self) -> None:
        self._read_anew(back=True)
        self._ask_once_read()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Enter: write, if what was typed is what was asked for as things stand now."""
        shown, asked = self._shown, self._needed()
        if shown is None or not self._asking:
            return
        if not agrees(event.value, asked):
            self._trouble = f"'{event.value}' is not '{asked}': nothing was sent"
            event.input.value = ""
        elif not self._going_back and _stamp(shown.file) != self._read_of:
            self._read_anew(back=False)
            self._trouble = f"{shown.file} has changed since it was shown: nothing was sent; look again"
        elif against := self._obstacle():
            self._ask(False)
            self._trouble = against
        else:
            self._ask(False)
            self.desk.jobs.start(WRITE, self._words(shown))
            self._written = self.desk.jobs.state(WRITE)
        self._draw()

    def _words(self, shown: Comparison) -> tuple[str, ...]:
        """The command line that writes what is chosen."""
        action = "rollback" if self._going_back else "upload"
        words = ["params", action, str(shown.file), "--yes", "--receipts", str(self.desk.receipts)]
        words += ["--system", str(shown.system)]
        words += ["--armed"] if self._armed() else []
        if not self._going_back:
            words += ["--despite-doubts"] if shown.doubted else []
            only = shown.only(self._chosen)
            words += ["--only", *only] if only else []
        return tuple(words)

    def _read_anew(self, *, back: bool) -> None:
        """Read the vehicle beside the file, or beside the values before the last upload."""
        if self.desk.jobs.runs(READ) or self.desk.jobs.runs(WRITE):
            return
        self._ask(False)
        self._going_back, self._asks_once_read, self._trouble = back, False, ""
        self._shown, self._written = None, None
        receipts = ("--receipts", str(self.desk.receipts))
        file = self._file()
        self._taken = self.desk.jobs.state(READ)
        if back:
            self.desk.jobs.start(READ, ("params", "rollback", "--dry-run", *receipts))
        elif file is not None:
            self._read_of = _stamp(file)
            self.desk.jobs.start(READ, ("params", "diff", str(file), *receipts))
        self._draw()

    def _file(self) -> Path | None:
        """The file that another screen laid on the desk for the chosen dive, else what was identified from it."""
        dive, param = self.desk.chosen(), self.desk.param
        if param is not None and (dive is None or param.parent in (dive, dive.parent)):
            return param
        if dive is None:
            return None
        beside = dive / IDENTIFIED if dive.is_dir() else dive.with_name(f"{dive.stem}-{IDENTIFIED}")
        return beside if beside.exists() else None

    def _take_read(self) -> None:
        """Take what was compared, once it was."""
        state = self.desk.jobs.state(READ)
        if state is None or state.done is None or state is self._taken:
            return
        self._taken = state
        self._shown = comparison(state.done.result)
        if self._shown is None:
            self._trouble = " ".join(state.done.said[-1:]).removeprefix("seatrial: ")
            self._asks_once_read = False
            return
        if self._going_back:
            # All that the vehicle held is in that file; what is so already is of no interest.
            self._shown = replace(self._shown, entries=tuple(e for e in self._shown.entries if e.changes))
        self._chosen = set(self._shown.changed)
        self._at = max(0, min(self._at, len(self._shown.entries) - 1))
        if self._asks_once_read:
            self._ask_once_read()

    def _take_written(self) -> None:
        """Keep the newest of what is being written; it stays until the vehicle is read again."""
        if self._written is not None:
            self._written = self.desk.jobs.state(WRITE)

    def _ask_once_read(self) -> None:
        """Ask now, or as soon as the vehicle is read."""
        if self.desk.jobs.runs(READ):
            self._asks_once_read = True
            return
        self._asks_once_read = False
        if self._shown is None:
            return
        self._trouble = self._obstacle()
        if not self._trouble:
            self._written = None
            self._ask(True)
        self._draw()

    def _obstacle(self) -> str:
        """Why nothing can be written now, "" where it can."""
        shown = self._shown
        if shown is None:
            return "nothing was read yet"
        if not self._chosen and not (shown.writes and not shown.changed):
            where = "the vehicle holds all of it already" if not shown.changed else "no line is chosen"
            return f"{where}: there is nothing to write"
        mode = self.view.picture.ff_mode if self.view is not None else None
        acts = (shown.ff_mode if mode is None else mode) in ACTING
        if self._armed() and shown.needs_disarmed and acts:
            return (
                "the vehicle is ARMED and its feed-forward acts on the thrusters: "
                f"force it off first, by {self.key_of('ff.off')}"
            )
        return ""

    def _armed(self) -> bool:
        """Whether the vehicle is armed, by its newest HEARTBEAT."""
        armed = self.view.picture.armed if self.view is not None else Armed.UNKNOWN
        if armed is Armed.UNKNOWN:
            return self._shown is not None and self._shown.armed
        return armed is not Armed.DISARMED

    def _needed(self) -> str:
        doubted = self._shown is not None and self._shown.doubted and not self._going_back
        return needed(len(self._chosen), armed=self._armed(), doubted=doubted)

    def _is_old(self) -> bool:
        """Whether what is shown was read too long ago, or was written upon since."""
        state = self._taken
        read_s = -OLD_S if state is None or state.ended_s is None else state.ended_s
        return self._shown is None or self._written is not None or self.desk.jobs.now_s() - read_s > OLD_S

    def _ask(self, asks: bool) -> None:
        """Show or hide the line to type into."""
        self._asking = asks
        self.set_class(asks, "-asking")
        typed = self.query_one("#parameters-typed", Input)
        typed.value = ""
        typed.disabled = not asks
        if asks:
            # Only what is drawn can be typed into.
            self.call_after_refresh(typed.focus)
        else:
            self.set_focus(None)

    def _entry(self) -> Entry | None:
        entries = self._shown.entries if self._shown is not None else ()
        return entries[self._at] if self._at < len(entries) else None

    def _draw(self) -> None:
        self.refresh_bindings()
        for widget in self.query(Drawn):
            widget.again()

    def _top(self, cells: int, rows: int) -> Lines:
        del rows
        if self._shown is not None:
            head = lines.top(self._shown, self._chosen, cells, back=self._going_back)
            return (*head, *self._state(cells))
        if self._trouble:
            return wrapped(self._trouble, "bad", cells)
        reading = self.desk.jobs.state(READ)
        if reading is not None and reading.runs:
            told = reading.told[-1] if reading.told else None
            return (lines.progress(told.share if told else 0.0, told.words if told else "begins", cells),)
        return wrapped(self._nothing(), "plain", cells)

    def _nothing(self) -> str:
        dive = self.desk.chosen()
        if dive is None:
            return f"{self.desk.out}: holds no dive yet; a recording makes one"
        return f"{dive.name}: nothing was identified from it yet, so there is nothing to compare"

    def _state(self, cells: int) -> Lines:
        """What speaks against it, or how far the writing is, and how it ended."""
        told: Lines = wrapped(self._trouble, "bad", cells) if self._trouble else ()
        written = self._written
        if written is None:
            return told
        last = written.told[-1] if written.told else None
        if written.done is None:
            share, words = (last.share, last.words) if last is not None else (0.0, "looking for the vehicle")
            bar = lines.progress(share, words, cells)
            return (*told, *wrapped("The parameters are being written.", "strong", cells), bar)
        result = written.done.result
        if result is None:
            said = " ".join(written.done.said[-1:]).removeprefix("seatrial: ")
            return (*told, *wrapped(said or "it ended without a word", "bad", cells))
        good = written.done.code == 0
        sentence = (
            f"{'✓' if good else lines.DOUBT} {result['outcome'].replace('_', ' ')}: {result['sentence']}"
        )
        told = (*told, *wrapped(sentence, "strong" if good else "bad", cells))
        return (*told, *wrapped(f"values before: {result['preimage']}", "quiet", cells))

    def _became(self) -> dict[str, str]:
        """What became of each line that was written, as far as it is known."""
        written = self._written
        if written is None:
            return {}
        found = dict(line for told in written.told if (line := told.line) is not None)
        done = written.done
        if done is not None and done.result is not None and self._shown is not None:
            for row in done.result["parameters"]:
                if row["name"] in self._shown.changed:
                    found[row["name"]] = lines.EQUAL if row["outcome"] == "applied" else row["sentence"]
        return found

    def _table(self, cells: int, rows: int) -> Lines:
        if self._shown is None:
            return ()
        became = self._became()
        return lines.table(self._shown, self._chosen, self._at, became, cells, rows, back=self._going_back)

    def _below(self, cells: int, rows: int) -> Lines:
        del rows
        entry = self._entry()
        if entry is None or self._shown is None:
            return ()
        notes = tuple(line for note in self._shown.notes for line in wrapped(note, "quiet", cells))
        return (*lines.details(entry, self._became().get(entry.name, ""), cells), *notes)

    def _question(self, cells: int, rows: int) -> Lines:
        del rows
        if not self._asking or self._shown is None:
            return ()
        armed, asked = self._armed(), self._needed()
        return lines.asking(
            self._shown, len(self._chosen), asked, armed=armed, back=self._going_back, cells=cells
        )


def _stamp(file: Path) -> tuple[Path, int] | None:
    """What a file is known by until it is written again; None where it is gone."""
    try:
        return file, file.stat().st_mtime_ns
    except OSError:
        return None
