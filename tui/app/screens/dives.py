"""Dives: the recordings, the coefficients that each could identify before any fit, and the work to start on one."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar, Final

from textual.app import ComposeResult
from textual.containers import Horizontal, VerticalScroll

from bridge.errors import SeatrialError
from gcs_plugin.dives.conditions import NOTHING_SAID, TITLES, mistakes, of_texts, texts_of
from gcs_plugin.dives.folder import About, DiveFolder, last_conditions
from tui.app.desk import LIST
from tui.app.drawing import Line, Lines, entry_at, hanging, heading
from tui.app.header import PHONE, Tab
from tui.app.jobs import aside
from tui.app.keys import HIDDEN, LOOKS, Action, bindings
from tui.app.screens.dives_lines import (
    CHOSEN,
    RECORDED,
    UNREAD,
    details,
    has_grown,
    is_unread,
    listed,
    table,
    usual,
    with_unread,
)
from tui.app.screens.frame import Drawn, StationScreen
from tui.app.screens.overlays import FormScreen
from tui.app.view import View, open_replay
from tui.dive_list import DiveRow

WORK: Final = ("identify", "diagnose", "validate")
"""Screens whose work is begun here."""


class DivesScreen(StationScreen):
    """The list of dives with the details of the marked dive, below it or, on a wide screen, next to it."""

    ACTIONS: ClassVar[tuple[Action, ...]] = (
        Action("dives.identify", "i", "Identify", "identify this dive, at once", call="begin('identify')"),
        Action("dives.diagnose", "d", "Diagnose", "diagnose this dive, at once", call="begin('diagnose')"),
        Action("dives.validate", "v", "Validate", "validate this dive, at once", call="begin('validate')"),
        Action("dives.choose", "enter", "Choose", "the other screens show this dive", HIDDEN | LOOKS),
        Action("dives.replay", "r", "Replay", "play this dive on Watch", LOOKS),
        Action("dives.note", "n", "Note", "what is noted of this dive, to be changed", HIDDEN),
        Action("dives.conditions", "c", "Conditions", "water, tether, ballast, payload, weather", HIDDEN),
        Action("dives.again", "ctrl+r", "Read", "read the folder again", HIDDEN | LOOKS),
        Action("dives.up", "up,k", "Up", "a newer dive", HIDDEN | LOOKS, "go(-1)"),
        Action("dives.down", "down,j", "Down", "an older dive", HIDDEN | LOOKS, "go(1)"),
        Action("dives.newest", "home", "Newest", "the newest dive flown; again, the newest", HIDDEN | LOOKS),
        Action("dives.oldest", "end", "Oldest", "the oldest dive", HIDDEN | LOOKS, "go(100000)"),
    )
    BINDINGS = bindings(ACTIONS)  # type: ignore[assignment]
    # Side by side only where the table has room for its names.
    HORIZONTAL_BREAKPOINTS = [(0, "-phone"), (PHONE, "-narrow"), (160, "-wide")]  # noqa: RUF012
    LEGEND: ClassVar[tuple[tuple[str, str], ...]] = (
        (CHOSEN, "the dive that the other screens show"),
        (RECORDED, "it is being recorded"),
        ("U u ·", "the dive could tell this axis's value to 10 %, to 30 %, not at all"),
        ("------", "nobody knows what it could tell"),
        (UNREAD, "its recording is yet to be read"),
    )

    def __init__(self, title: str, tabs: Sequence[Tab]) -> None:
        super().__init__(title, tabs)
        self._dives: tuple[DiveRow, ...] = ()
        self._at: Path | None = None
        self._list: object = None
        self._written: frozenset[Path] = frozenset()
        self._recorded: frozenset[Path] = frozenset()
        self._over: Path | None = None
        self._stale = False
        self._goes_home = False
        self._by_home: Path | None = None
        self._trouble = self._unkept = ""

    def body(self) -> ComposeResult:
        with Horizontal(id="dives"):
            yield Drawn(self._table, id="dive-table", pressed=lambda _, y: self._go_to_line(y))
            with VerticalScroll(id="dive-scroll", can_focus=False):
                yield Drawn(self._details, id="dive-details")

    def on_screen_resume(self) -> None:
        self.action_again()

    def on_screen_suspend(self) -> None:
        self._by_home = None
        if self in self.app.screen_stack:
            return  # only covered, by a question or the help
        if self.desk.then in WORK:
            self.notify("nothing was begun: Dives was left before it was read", severity="warning")
        self.desk.then, self._goes_home = "", False

    def begin(self) -> None:
        """Identify the dive that the crew has just made, regardless of the mark, once the list is read."""
        self._at = self._over = self.desk.dive = None
        self.action_again()
        self.desk.then = "identify"

    def show(self, view: View) -> None:
        before, self._written = self._written, self.desk.written()
        if ended := before - self._written:
            self._over = max(ended)
        self._stale |= before != self._written
        if self._stale and not self.desk.jobs.runs(LIST):
            self._stale = False
            self.action_again()
        self._take_list()
        # Take the list first: a dive that is recorded grows during every read, and it would be read for ever.
        grown = any(d.folder.resolve() in self._written and has_grown(d) for d in self._dives)
        if grown and not self.desk.jobs.runs(LIST):
            self.action_again()
        self._recorded = frozenset(d.folder for d in self._dives if d.folder.resolve() in self._written)
        super().show(view)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """The keys for a dive need one, or a list that is still to be read."""
        if action in ("begin", "choose", "replay", "note", "conditions"):
            return bool(self._dives) or self._list is None or self.desk.jobs.runs(LIST)
        return super().check_action(action, parameters)

    def action_again(self) -> None:
        self.desk.read_dives()
        self._dives = with_unread(self._dives, self.desk.out)

    def action_go(self, rows: int) -> None:
        if self._dives:
            self._go(max(0, min(self._index() + rows, len(self._dives) - 1)))

    def action_newest(self) -> None:
        """Mark the newest dive that tells something; if this key has just marked it, the newest of all.

        While newer dives are being read, nothing is marked until it is known which of them tells something.
        """
        if not self._dives:
            return
        flown = usual(self._dives, None)
        at = next((n for n, dive in enumerate(self._dives) if dive.folder == flown), 0)
        if self._goes_home or self._by_home == self._at == self._dives[at].folder:
            at = 0
        elif self.desk.jobs.runs(LIST) and any(map(is_unread, self._dives[: at + 1])):
            self._at, self._goes_home = None, True
            self.draw()
            return
        self._go(at)
        self._by_home = self._at

    def _go_to_line(self, y: int) -> None:
        """Move the mark to the dive in line `y` of the widget, whose first line is a heading."""
        rows = self.query_one("#dive-table").size.height - 1
        entry = entry_at(y - 1, len(self._dives), self._index(), rows)
        if entry is not None:
            self._go(entry)

    def action_choose(self) -> None:
        if self._at is not None:
            self.desk.dive = self._at
            self.draw()

    async def action_begin(self, screen: str) -> None:
        if (dive := self._dive_for(screen)) is not None:
            self.desk.dive = dive.folder
            await self.begin_on(screen)

    def action_note(self) -> None:
        dive = self._dive_for("note")
        about = self._about(dive) if dive is not None else None
        if dive is None or about is None:
            return

        def keep(texts: Mapping[str, str]) -> None:
            DiveFolder(dive.folder).note(texts["note"])

        texts = {"note": " ".join(about.notes.split())}
        # The list is read again when this screen returns.
        self.app.push_screen(FormScreen(f"Note of {dive.name}", {"note": ""}, texts, lambda _: {}, keep))

    def _about(self, dive: DiveRow) -> About | None:
        """What is noted of a dive now, which another program may have changed since the list was read; None, and said
        why, if it can't be read."""
        self._unkept = ""
        try:
            return DiveFolder(dive.folder).about()
        except SeatrialError as error:
            self._unkept = str(error)
            self.draw()
            return None

    def action_replay(self) -> None:
        if (dive := self._dive_for("replay")) is not None:
            self.run_worker(self._replay(dive.folder), exclusive=True)

    async def _replay(self, folder: Path) -> None:
        """Read the recording in another thread, then show it on Watch, unless the crew does something else by then."""
        self._unkept = ""
        try:
            replay = await aside(lambda: open_replay(folder, self.desk.vehicle_of(folder)))
        except SeatrialError as error:
            self._unkept = str(error)
            self.draw()
            return
        if not self.is_current:
            self.notify(
                f"{folder.name} is not replayed: Dives was left before it was read", severity="warning"
            )
            return
        self.desk.replay = replay
        await self.begin_on("watch")

    def action_conditions(self) -> None:
        """Ask for the conditions of the dive; if none are known, start from those of the previous dive."""
        dive = self._dive_for("conditions")
        about = self._about(dive) if dive is not None else None
        if dive is None or about is None:
            return
        known = about.conditions
        title = f"Conditions of {dive.name}"
        if known == NOTHING_SAID:
            known = last_conditions(dive.folder.resolve().parent, dive.folder)
            title += ", as in the dive before" if known != NOTHING_SAID else ""

        def keep(texts: Mapping[str, str]) -> None:
            DiveFolder(dive.folder).set_conditions(of_texts(texts))

        # The list is read again when this screen returns.
        self.app.push_screen(FormScreen(title, TITLES, texts_of(known), mistakes, keep))

    def _take_list(self) -> None:
        """Take the verb's list once it is complete."""
        state = self.desk.jobs.state(LIST)
        if state is None or state.done is None or state is self._list:
            return
        self._list = state
        self._trouble = "" if state.done.result is not None else state.done.why
        self._dives = listed(state.done.result)
        self.refresh_bindings()
        # The mark moves once to a dive that has just ended: it is the dive that the crew has just made. Others may have
        # begun and ended after it while another screen was looked at.
        if any(_same(dive.folder, self._over) for dive in self._dives):
            ended = (dive.folder for dive in self._dives if dive.folder.resolve() not in self._written)
            self._at, self._over = next(ended, self._at), None
        if self._goes_home and self._dives:
            self._at = self._by_home = usual(self._dives, self._dives[0].folder)
        self._goes_home = False
        self.desk.mean(
            usual([dive for dive in self._dives if dive.folder.resolve() not in self._written], None)
        )
        if all(dive.folder != self._at for dive in self._dives):
            meant = self.desk.chosen()
            self._at = next((d.folder for d in self._dives if _same(d.folder, meant)), None)
            if self._at is None and self._dives:
                self._at = self._dives[0].folder
        then, self.desk.then = self.desk.then, ""
        if then and self._dives:
            self._tell_skipped()
            self.call_later(self.run_action, f"begin('{then}')" if then in WORK else then)

    def _dive_for(self, action: str) -> DiveRow | None:
        """The marked dive. Without one the action or work follows once the list is there; of quick keys the first."""
        dive = self._dive()
        if dive is None and self.desk.jobs.runs(LIST):
            self.desk.then = self.desk.then or action
        return dive

    def _tell_skipped(self) -> None:
        """Name the newer dives that are skipped, so that nobody mistakes an older dive for the newest."""
        among = self._dives[: self._index() + 1]
        names = [dive.name for dive in among]
        if len(set(names)) < len(names):
            names = [dive.folder.name for dive in among]  # with the date, as two dives share a name
        *skipped, meant = names
        if skipped:
            newer = " and ".join(reversed(skipped))
            self.notify(f"{meant}; {newer}, recorded since, can tell nothing yet")

    def _index(self) -> int:
        """Index of the marked dive; -1 until the list or a key places the mark."""
        return next((n for n, dive in enumerate(self._dives) if dive.folder == self._at), -1)

    def _dive(self) -> DiveRow | None:
        return self._dives[self._index()] if self._index() >= 0 else None

    def _go(self, entry: int) -> None:
        self._at, self._goes_home = self._dives[entry].folder, False
        self.draw()
        for scroll in self.query(VerticalScroll):  # none yet if the key came before the screen was composed
            scroll.scroll_home(animate=False)

    def _table(self, cells: int, rows: int) -> Lines:
        head = heading("DIVES", self._reading(), cells)
        if not self._dives:
            return (head, *self._none(cells))
        chosen = next((d.folder for d in self._dives if _same(d.folder, self.desk.dive)), None)
        return (head, *table(self._dives, self._index(), chosen, self._recorded, cells, rows - 1))

    def _none(self, cells: int) -> tuple[Line, ...]:
        if not self.desk.out.exists():
            return hanging(self.desk.no_dive, "plain", cells)
        if self._trouble and not self.desk.jobs.runs(LIST):
            return hanging(self._trouble, "bad", cells)
        if self._list is None or self.desk.jobs.runs(LIST):
            return (((f"reading {self.desk.out}", "quiet"),),)
        return hanging(self.desk.no_dive, "plain", cells)

    def _reading(self) -> str:
        """Progress of reading the list, for its heading."""
        state = self.desk.jobs.state(LIST)
        if state is None or not state.runs:
            return f"{len(self._dives)} in {self.desk.out}" if self._dives else ""
        reads = state.reports[-1].words if state.reports else "reading"
        return f"{reads}, then {self.desk.then}" if self.desk.then else reads

    def _details(self, cells: int, _: int) -> Lines:
        dive = self._dive()
        if dive is None:
            return ((),)  # a widget of zero height would not be asked again
        unkept = hanging(self._unkept, "bad", cells) if self._unkept else ()
        return (
            *unkept,
            *details(dive, dive.folder in self._recorded, cells, self.key_of("dives.conditions")),
        )


def _same(folder: Path, other: Path | None) -> bool:
    return other is not None and folder.resolve() == other.resolve()
