"""The terminal app: ties together screens, keys, themes and the views that a station makes."""

import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import ClassVar

from rich.text import Text
from textual.binding import Binding
from textual.css.query import NoMatches
from textual.filter import LineFilter, NoColor
from textual.worker import WorkerFailed

from bridge.errors import ConfigError, SeatrialError
from bridge.vehicle.config import shipped_vehicles
from gcs_plugin.bell import Bell
from gcs_plugin.dives.folder import DiveFolder
from gcs_plugin.params.unfinished import reminder, unfinished
from gcs_plugin.watch.alarms import SHIPPED, Settings
from gcs_plugin.watch.picture import Kind, Picture
from tui.app import themes
from tui.app.alarm_notes import AlarmEvent, AlarmNotes
from tui.app.crash_trace import keep_trace
from tui.app.desk import Desk
from tui.app.jobs import aside
from tui.app.keys import EVERYWHERE, Action, Keymap, bindings
from tui.app.modes import Modes
from tui.app.next_step import Flight, Situation, next_of
from tui.app.read_situation import ORDER, read_situation
from tui.app.recordings import TELL_S
from tui.app.screens.fly import FLY, flight_of
from tui.app.screens.frame import StationScreen
from tui.app.screens.overlays import AskScreen, HelpScreen, help_lines
from tui.app.screens.parameters_transfer import WRITE
from tui.app.screens.table import OPENING, SCREENS, ActionPalette, ActionProvider, Row, tabs
from tui.app.terminal import AnsweringDriver, RefreshRate
from tui.app.view import View, Views, aged

WORDS_OF_COPY = Binding("ctrl+c", "help_quit", show=False, system=True)

LOOK_EVERY_S = 1.0


class SeatrialApp(Modes, inherit_bindings=False):
    """Shows the views that `views` makes, `fps` times a second; `keep_theme` saves the chosen theme.

    `desk` holds the work that the screens share. `view_only`: the user may look but not act. `begins`: a
    recording is to begin with the app. `alarms` say how it rings.
    """

    TITLE = "seatrial"
    CSS_PATH = "look.tcss"
    CSS = themes.component_css()
    BINDINGS = [*bindings((*EVERYWHERE, *OPENING)), WORDS_OF_COPY]  # noqa: RUF012 (Textual's own type)
    COMMANDS: ClassVar = {ActionProvider}
    AT_ONCE = frozenset({"ff.off"})

    def __init__(
        self,
        views: Views,
        theme: str = themes.ORDER[0],
        keymap: Keymap | None = None,
        fps: float = 4.0,
        keep_theme: Callable[[str], None] = themes.keep_theme,
        clock: Callable[[], float] = time.monotonic,
        driver: type[AnsweringDriver] | None = None,
        desk: Desk | None = None,
        view_only: bool = False,
        begins: bool = False,
        alarms: Settings = SHIPPED,
    ) -> None:
        super().__init__(views, keymap, driver, desk, view_only, clock)
        self._begins_recording = begins
        self._bell, self._alarm_notes = Bell(alarms, self.bell), AlarmNotes()
        self._keep_theme, self._pace = keep_theme, RefreshRate(fps)
        self._dies = False
        self._step: tuple[float, tuple[tuple[Kind, str], ...], Situation] | None = None
        self._warned_of: set[tuple[str, float]] = set()
        for name in themes.ORDER:
            self.register_theme(themes.theme(name))
        self.theme = theme
        self.set_keymap(self._keys)
        for row in SCREENS:
            self.add_mode(row.id, partial(self._screen, row))

    def get_theme_variable_defaults(self) -> dict[str, str]:
        return themes.variables(themes.ORDER[0])

    def get_line_filters(self) -> Sequence[LineFilter]:
        """With NO_COLOR, remove all colour, where Textual would leave greys."""
        return [NoColor()] if self.no_color else super().get_line_filters()

    def on_mount(self) -> None:
        if isinstance(self._driver, AnsweringDriver):
            self._driver.answered = partial(self.call_later, self._answered)
        # With nothing to watch, the dives that are here come first. The first view may not know of a recording yet.
        named, running = self.desk.recorded(), self._views.view().recording
        self._news.known = {folder for folder in (named, running and Path(running.folder)) if folder}
        nothing = not self._begins_recording and not self.desk.links() and not self._news.known
        self.switch_mode("dives" if nothing and self.desk.connect is not None else SCREENS[0].id)
        left = unfinished(self.desk.receipts)
        if left is not None:
            self._warn(
                f"{reminder(left, {})[0]}; Parameters tells more",
                lambda: unfinished(self.desk.receipts) is not None,
                timeout=TELL_S,
            )
        self._tell_of_others()
        if self._begins_recording:
            self._begin()
        self.call_after_refresh(self._refresh_view)

    async def do_on(self, screen: str, action: Action) -> None:
        """Open a screen and run one of its actions there; say so if the action has nothing to do there now."""
        await self.action_open(screen)
        if isinstance(self.screen, StationScreen) and self.screen.offers(action):
            await self.run_action(action.call, self.screen)
        else:
            self.notify(f"{action.words}: there is nothing for it to do on {self.screen.title} now")

    async def action_quit(self) -> None:
        """Leave the app; refused while parameters or a mode are sent, and asked twice while a long verb runs or OFF is
        not confirmed yet.

        Verbs end with the app, and so does OFF.
        """
        jobs = self.desk.jobs
        if jobs.runs(ORDER):
            self._warn(
                "a mode is on its way to the vehicle; leave once that has ended", lambda: jobs.runs(ORDER)
            )
            return
        if jobs.runs(WRITE):
            await self.action_open("parameters")
            self._warn("parameters are being written; leave once that has ended", lambda: jobs.runs(WRITE))
            return
        if jobs.runs(FLY):
            await self.action_open("fly")
            flies = (
                "the vehicle flies"
                if flight_of(jobs) is Flight.UNDER_WAY
                else "the flight is being worked on"
            )
            self._warn(
                f"{flies}; leave once that has ended, {self._key_of_id('flight.end')} ends it",
                lambda: jobs.runs(FLY),
            )
            return
        leaves = self._key_of_id("app.quit")
        if self._is_off_under_way() and not self._off_may_end:
            self._off_may_end = True
            self._warn(
                f"OFF is not confirmed yet, and is sent no more once you leave; {leaves} again leaves",
                self._is_off_under_way,
            )
            return
        at_work = self._at_work()
        if at_work <= self._warned_of:
            self.exit()
            return
        self._warned_of |= at_work
        verbs = " and ".join(sorted(verb for verb, _ in at_work))
        self._warn(
            f"{verbs} at work, and lost if you leave now; {leaves} again leaves",
            lambda: bool(at_work & self._at_work()),
        )

    def action_help_quit(self) -> None:
        """Ctrl-C ends nothing here: say which key leaves."""
        goes_on = "; the recording goes on" if self._views.view().records else ""
        self.notify(f"{self._key_of_id('app.quit')} leaves{goes_on}")

    def action_name_vehicle(self) -> None:
        """Ask for the vehicle file of a dive that names none."""
        name_vehicle = self.desk.name_vehicle
        if name_vehicle is None or isinstance(self.screen, AskScreen):
            return

        def answered(typed: str | None) -> None:
            if not typed or not typed.strip():
                return
            try:
                name_vehicle(typed.strip())
            except ConfigError as error:
                self.notify(str(error), severity="error", timeout=TELL_S)
                return
            self.desk.vehicle = typed.strip()
            self._step = None

        self.push_screen(
            AskScreen("The vehicle's file, or one that is here", "takes it", shipped_vehicles()), answered
        )

    def action_command_palette(self) -> None:
        if not isinstance(self.screen, ActionPalette):
            self.push_screen(ActionPalette(id="--command-palette"))

    def action_help(self) -> None:
        if not isinstance(self.screen, HelpScreen):
            self.push_screen(HelpScreen(help_lines(self, self.screen)))

    def action_next_theme(self) -> None:
        self.action_use_theme(themes.next_theme(self.theme))

    def action_use_theme(self, name: str) -> None:
        self.theme = name
        if not self.view_only:
            self._keep_theme(name)

    def _handle_exception(self, error: Exception) -> None:
        """Die of the error, unless the palette was closed before it was drawn and only its own search failed."""
        if not (isinstance(error, WorkerFailed) and isinstance(error.error, NoMatches)):
            super()._handle_exception(error)

    def _fatal_error(self) -> None:
        """Leave at once on an uncaught exception, with one sentence.

        Textual's own report draws all local variables of the failing code, which takes seconds.
        """
        error = sys.exception()
        if self._dies or error is None:
            return
        self._dies = True
        self.panic(Text(keep_trace(error)))

    def _screen(self, row: Row) -> StationScreen:
        screen = row.make(row.title, tabs(row.id, self._key_of))
        screen.fit(self.size)
        return screen

    def _refresh_view(self) -> None:
        now_s = self._clock()
        self._tell_recording()
        self._watch_over_off()
        self._tell_ordered()
        self._hear_alarms()
        if self._pace.may_draw(now_s):
            self._show()
            if isinstance(self._driver, AnsweringDriver) and self._pace.may_ask():
                self._pace.on_asked(now_s)
                self.call_after_refresh(self._driver.ask)
        period_s = self._pace.period_s(now_s)
        self._views.set_period(period_s)
        self.call_later(self.next_key)
        self.set_timer(period_s, self._refresh_view)

    def _situation(self, view: View) -> Situation:
        """The situation, read once a second at most, and as soon as an alarm comes or goes."""
        now_s, alarms = self._clock(), tuple(alarm.key for alarm in view.alarms)
        if self._step is None or now_s >= self._step[0] + LOOK_EVERY_S or alarms != self._step[1]:
            self._step = (now_s, alarms, read_situation(self.desk, view))
        return self._step[2]

    @property
    def picture(self) -> Picture:
        """The vehicle as it is now."""
        return self._views.view().picture

    def _hear_alarms(self) -> None:
        """Ring for new alarms, and note them, whether or not the terminal takes a drawing now."""
        view, _ = self._news.seen(self._views.view())
        view = replace(view, view_only=self.view_only)
        if events := self._alarm_notes.take(self._bell.hear(view.alarms, view.picture.now_s), view):
            self.run_worker(self._note(events), group="notes")

    async def _note(self, events: Sequence[AlarmEvent]) -> None:
        """Leave alarms as events in their dive folders."""
        for event in events:
            try:
                await aside(partial(DiveFolder(event.folder).add_event, event.unix_s, event.text))
            except SeatrialError as error:
                self._warn(f"not noted in the dive: {error}", lambda: True)

    def _answered(self) -> None:
        self._pace.on_answered(self._clock())

    def _show(self) -> None:
        self._take_back_warnings()
        view, for_step = self._news.seen(self._views.view())
        situation = self._situation(for_step)
        view = replace(view, situation=situation, next=next_of(situation), view_only=self.view_only)
        if view.recording is None and not view.over and (begins := self._begins()):
            known = self.desk.links() or self.desk.connect is None
            trouble = (view.trouble or "no recording runs") if known else "no vehicle is connected"
            starts = self._starts_recording()
            view = replace(view, trouble="a recording begins" if starts else f"{trouble}{begins}")
        replayed = None if self.desk.replay is None else self.desk.replay.shown()
        view = replace(view, picture=aged(view.picture, view.behind_s), replay=replayed)
        toasts = [toast for screen in self.screen_stack[-1:] for toast in screen.query("Toast")]
        rows = sum(toast.region.height for toast in toasts)
        for screen in self.screen_stack:
            if isinstance(screen, StationScreen):
                screen.keep_free(rows)
                screen.show(view)
