"""Parameters: the vehicle's against identified and last accepted values; upload and rollback, confirmed by typing."""

from functools import cached_property
from typing import ClassVar

from textual.app import ComposeResult
from textual.containers import Horizontal, VerticalScroll
from textual.widgets import Input

from bridge.reports import Written
from gcs_plugin.params.comparison import Compared
from gcs_plugin.watch.picture import Picture
from tui.app.drawing import Lines, entry_at, stacked, wrapped
from tui.app.keys import HIDDEN, LOOKS, Action, bindings
from tui.app.screens import parameters_lines as lines
from tui.app.screens import parameters_table
from tui.app.screens.frame import Drawn, StationScreen
from tui.app.screens.overlays import AskLine
from tui.app.screens.parameters_in_file import in_file
from tui.app.screens.parameters_transfer import READ, ParameterTransfer
from tui.app.view import View, heard_of


class ParametersScreen(StationScreen):
    """The table above, the details of the marked line and the confirmation below."""

    ACTIONS: ClassVar[tuple[Action, ...]] = (
        # The main key first: where there is little room, the last ones go.
        Action("parameters.upload", "u", "Upload", "write the chosen lines; asks for their number"),
        Action("parameters.back", "r", "Roll back", "the values before the last upload; asks likewise"),
        Action("parameters.choose", "space", "Choose", "write this line, or leave it as it is", LOOKS),
        Action("parameters.all", "a", "All", "choose all lines that change, or none", LOOKS),
        Action("parameters.read", "ctrl+r", "Read", "read the vehicle again", HIDDEN),
        Action("parameters.up", "up,k", "Up", "the line above", HIDDEN | LOOKS, "go(-1)"),
        Action("parameters.down", "down,j", "Down", "the line below", HIDDEN | LOOKS, "go(1)"),
        Action("parameters.first", "home", "First", "the first line", HIDDEN | LOOKS, "go(-1000)"),
        Action("parameters.last", "end", "Last", "the last line", HIDDEN | LOOKS, "go(1000)"),
    )
    BINDINGS = bindings(ACTIONS)  # type: ignore[assignment]
    LEGEND: ClassVar[tuple[tuple[str, str], ...]] = (
        (
            f"{parameters_table.CHOSEN} {parameters_table.LEFT}",
            "a line that changes: to be written, or left as it is",
        ),
        (parameters_table.DOUBT, "the value is doubted; the line below the table says why"),
        (
            parameters_table.IN_HALVES,
            "the change in halves of the 95 % interval: 1 and less is within it, over 3 is worth a second look",
        ),
        (
            parameters_table.HALF,
            "half the 95 % interval in the line's unit, given the thrust by which the values act; Identify's wider "
            "interval holds the thrust's error too",
        ),
        ("accepted", "what was last uploaded and read back, and not rolled back since"),
    )

    _at = 0
    _offered: object = None

    @cached_property
    def _transfer(self) -> ParameterTransfer:
        return ParameterTransfer(self.desk)

    @property
    def _picture(self) -> Picture | None:
        return self.view.picture if self.view is not None else None

    @cached_property
    def _ask(self) -> AskLine:
        # Made before the screen is composed: bindings are checked, and keys arrive, before that.
        return AskLine(self._question, id="parameters-ask")

    def body(self) -> ComposeResult:
        yield Drawn(self._top, id="parameters-top")
        with Horizontal(id="parameters"):
            yield Drawn(self._table, id="parameters-table", pressed=lambda _, y: self._press(y))
            with VerticalScroll(id="parameters-scroll", can_focus=False):
                yield Drawn(self._below, id="parameters-below")
        yield self._ask

    def on_screen_resume(self) -> None:
        self._transfer.system, written = heard_of(self._station_app.picture), self._transfer.written
        unseen = written is not None and written.done is None
        if not self._ask.is_open and not unseen:
            self._transfer.read(back=False)
            self._draw()

    def show(self, view: View) -> None:
        self.view = view
        transfer, back = self._transfer, self._transfer.back
        transfer.system = heard_of(view.picture)
        if transfer.take():
            self._go(0)
            if back and not transfer.back:
                self._close()  # there is nothing to take back
            if self._ask.is_open and transfer.shown is not None:
                transfer.trouble = self._obstacle()
        if transfer.overtaken(self._picture):
            transfer.read(back=transfer.back)
        elif not self._ask.is_open and transfer.has_newer():
            transfer.read(back=False)
        offered = (self._ask.is_open, transfer.reads, transfer.writes, transfer.shown)
        if offered != self._offered:
            self._offered = offered
            self.refresh_bindings()
        super().show(view)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        transfer = self._transfer
        busy = transfer.writes or self._ask.is_open
        if action in ("choose", "all"):
            return transfer.shown is not None and not (busy or transfer.back)
        if action == "upload" and self.desk.param is None and self.desk.chosen() is None:
            return False
        if action in ("upload", "back", "read"):
            return self._ask.is_mounted and not busy
        return super().check_action(action, parameters)

    def close_up(self) -> None:
        """Close the question; without a question, return from a rollback to the file."""
        asked = self._ask.is_open
        if asked:
            self._close()
        if self._transfer.back and (self._transfer.shown is None or not asked):
            self._transfer.read(back=False)
        self._draw()

    def action_go(self, rows: int) -> None:
        self._go(rows)
        self._draw()

    def _press(self, y: int) -> None:
        """Move the mark to line `y` of the table; a click on the marked line chooses it."""
        rows = self.query_one("#parameters-table").size.height
        entry = entry_at(y, len(self._entries), self._at, rows)
        if entry is None:
            return
        if entry == self._at and self.check_action("choose", ()):
            self.action_choose()
        self._at = entry
        self._draw()

    def action_choose(self) -> None:
        entry = self._entry()
        if entry is not None and entry.choosable:
            self._transfer.chosen ^= {entry.name}
            self._draw()

    def action_all(self) -> None:
        self._transfer.choose_all()
        self._draw()

    def action_read(self) -> None:
        self._transfer.read(back=self._transfer.back)
        self._draw()

    def action_upload(self) -> None:
        """Ask for the confirmation; first read the vehicle if the comparison is old."""
        self._transfer.trouble = ""
        if self._transfer.back or self._transfer.is_old(self._picture):
            self._transfer.read(back=False)
        self._open()

    def action_back(self) -> None:
        self._transfer.read(back=True)
        self._open()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Enter: write if the text confirms. Text typed while the vehicle is still being read stays, and waits."""
        transfer = self._transfer
        if transfer.reads:
            transfer.trouble = "the vehicle is still being read: nothing was sent; press Enter again after it"
        elif against := self._obstacle():
            transfer.trouble = against if transfer.shown is not None else transfer.trouble
            self._close()
        elif transfer.write(event.value, self._picture):
            self._close()
        else:
            self._ask.empty()
        self._draw()

    def _open(self) -> None:
        """Ask, even while the vehicle is still being read, so that text typed meanwhile goes to the answer."""
        transfer = self._transfer
        if transfer.shown is not None:
            transfer.trouble = self._obstacle()
        if transfer.reads or (transfer.shown is not None and not transfer.trouble):
            transfer.written = None
            self.add_class("-asking")
            self._ask.open()
        elif transfer.shown is None and not transfer.trouble:
            self.notify(self._nothing(), severity="warning")
        self._draw()

    def _close(self) -> None:
        self.remove_class("-asking")
        self._ask.close()

    def _obstacle(self) -> str:
        return self._transfer.obstacle(self._picture, self.key_of("ff.off"))

    @property
    def _entries(self) -> tuple[Compared, ...]:
        return self._transfer.shown.parameters if self._transfer.shown is not None else ()

    def _entry(self) -> Compared | None:
        return self._entries[self._at] if self._at < len(self._entries) else None

    def _go(self, rows: int) -> None:
        if self._entries:
            self._at = max(0, min(self._at + rows, len(self._entries) - 1))

    def _draw(self) -> None:
        self.refresh_bindings()
        self.draw()

    def _top(self, cells: int, _: int) -> Lines:
        transfer = self._transfer
        trouble = wrapped(transfer.trouble, "bad", cells) if transfer.trouble else ()
        if transfer.shown is not None:
            stale_s = transfer.stale_s(self._picture)
            ended = transfer.written.done if transfer.written is not None else None
            done = ended is not None and not ended.code
            head = lines.heading(
                transfer.shown, transfer.chosen, stale_s, cells, back=transfer.back, done=done
            )
            if transfer.written is None:
                key = "" if transfer.back else self.key_of("parameters.upload")
                head += lines.waiting(transfer.shown, key, cells)
            retries = self.key_of("parameters.back" if transfer.back else "parameters.upload")
            return (*head, *trouble, *lines.writing(transfer.written, cells, retries))
        if trouble and not transfer.reads:
            if self.view_only:
                return trouble
            key = self.key_of("parameters.read")
            then = (
                f"{key} reads the vehicle again" if key else "escape leaves it, and the file is shown again"
            )
            return (*trouble, *wrapped(f"Nothing was written by this reading; {then}.", "strong", cells))
        reading = lines.reading(self.desk.jobs.state(READ), cells)
        return (*trouble, *reading) or wrapped(self._nothing(), "plain", cells)

    def _nothing(self) -> str:
        dive = self.desk.chosen()
        if dive is None:
            return self.desk.no_dive
        yet = f"{dive.name}: nothing was identified from it yet, so there is nothing to compare"
        if self.view_only:
            return f"{yet}; this view only looks, and identifies nothing"
        return f"{yet}; identify it, or choose another dive on Dives by Enter"

    def _became(self) -> dict[str, Written]:
        return lines.results(self._transfer.written, self._transfer.shown)

    def _table(self, cells: int, rows: int) -> Lines:
        transfer = self._transfer
        if transfer.shown is None:
            return in_file(transfer.unread, self.desk.receipts, cells) if transfer.unread else ()
        became = self._became()
        stale, back = transfer.stale_s(self._picture) is not None, transfer.back
        return parameters_table.table(
            transfer.shown, transfer.chosen, self._at, became, cells, rows, back=back, stale=stale
        )

    def _below(self, cells: int, _: int) -> Lines:
        entry, shown = self._entry(), self._transfer.shown
        if entry is None or shown is None:
            return ()
        # Notes from before a write may no longer hold after it.
        remarks = shown.notes if self._transfer.written is None else ()
        became, stale_s = self._became().get(entry.name), self._transfer.stale_s(self._picture)
        return (*lines.details(entry, became, stale_s, cells), *stacked(remarks, "quiet", cells))

    def _question(self, cells: int, _: int) -> Lines:
        transfer = self._transfer
        if transfer.reads:
            words = "The vehicle is being read; what is to be typed is asked then. Escape leaves it."
            return wrapped(words, "strong", cells)
        if transfer.shown is None or self._obstacle():
            return wrapped("Nothing can be sent, for what is said above; escape leaves it.", "strong", cells)
        armed, asked = transfer.armed(self._picture), transfer.needed(self._picture)
        chosen = len(transfer.chosen)
        return lines.asking(transfer.shown, chosen, asked, armed=armed, back=transfer.back, cells=cells)
