"""The terminal app: ties together screens, keys, themes and the views that a station makes."""

import math
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import ClassVar

from rich.text import Text
from textual.actions import ActionParseResult
from textual.binding import Binding
from textual.css.query import NoMatches
from textual.dom import DOMNode
from textual.filter import LineFilter, NoColor
from textual.notifications import Notification, Notify, SeverityLevel
from textual.worker import WorkerFailed

from bridge import exit_codes
from bridge.errors import ConfigError, SeatrialError
from bridge.vehicle.config import shipped_vehicles
from bridge.vehicle.mode import Mode
from gcs_plugin.bell import Bell
from gcs_plugin.dives.folder import DiveFolder
from gcs_plugin.params.last_accepted import reminder, unfinished
from gcs_plugin.watch.alarms import SHIPPED, Settings
from gcs_plugin.watch.picture import Armed, Kind
from tui.app import themes
from tui.app.alarm_notes import AlarmEvent, AlarmNotes
from tui.app.connecting import Choice
from tui.app.desk import Desk
from tui.app.jobs import JobState, aside
from tui.app.keys import EVERYWHERE, Action, Gate, Keymap, bindings
from tui.app.keys_in_turn import KeysInTurn
from tui.app.next_step import Flight, Situation, lowered_to, next_of, raised_to
from tui.app.read_situation import LONG, ORDER, read_situation
from tui.app.recording_news import RecordingNews
from tui.app.screens.connect import ConnectScreen
from tui.app.screens.fly import FLY, flight_of
from tui.app.screens.frame import StationScreen
from tui.app.screens.overlays import AskScreen, HelpScreen, help_lines
from tui.app.screens.table import OPENING, PLACES, SCREENS, ActionPalette, ActionProvider, Row, tabs
from tui.app.screens.transfer import ARMED, WRITE, agrees
from tui.app.terminal import AnsweringDriver, RefreshRate, keep_trace
from tui.app.view import View, Views, aged
from tui.show import harmless

WORDS_OF_COPY = Binding("ctrl+c", "help_quit", show=False, system=True)

GATE = Gate(action for place in PLACES for action in place)
TELL_S = 20.0
ORDERS = "orders"
ANNOUNCED_S = 60.0
LOOK_EVERY_S = 1.0
SETTLES_S = 0.01
END = "END"
BEING_SET = "a mode is on its way to the vehicle already"
NOTHING_RUNS = "no recording runs that the app could speak to"
VIEW_ONLY_WORDS = "VIEW ONLY: nothing is done from here"


class SeatrialApp(KeysInTurn, inherit_bindings=False):
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
        super().__init__(driver)
        self._bell, self._alarm_notes = Bell(alarms, self.bell), AlarmNotes()
        self.desk = desk or Desk()
        self.view_only = view_only
        self._views, self._keep_theme, self._clock = views, keep_theme, clock
        self._pace = RefreshRate(fps)
        self._keys = keymap or {}
        self._begins_recording = begins
        self._off_may_record = self._dies = False
        self._news = RecordingNews(self.desk, self._begins, self._next_dive)
        self._declinable_until_s = -math.inf
        self._step: tuple[float, tuple[tuple[Kind, str], ...], Situation] | None = None
        self._ordered: JobState | None = None
        self._warnings: list[tuple[Notification, Callable[[], bool]]] = []
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
        if self._begins_recording and self.desk.record is not None:
            self.run_worker(self._record(self.desk.record), group="record", exclusive=True)
        self.call_after_refresh(self._refresh_view)

    def notify(
        self,
        message: str,
        *,
        title: str = "",
        severity: SeverityLevel = "information",
        timeout: float | None = None,
        markup: bool = False,
    ) -> None:
        """Show a notification literally: markup in a name has no effect."""
        super().notify(harmless(message), title=title, severity=severity, timeout=timeout, markup=markup)

    def _warn(
        self,
        message: str,
        holds: Callable[[], bool],
        severity: SeverityLevel = "warning",
        timeout: float | None = None,
    ) -> None:
        """Warn, and take the warning back as soon as it holds no longer."""
        shown = self.NOTIFICATION_TIMEOUT if timeout is None else timeout
        warning = Notification(harmless(message), severity=severity, timeout=shown, markup=False)
        self._warnings.append((warning, holds))
        self.post_message(Notify(warning))

    def _take_back_warnings(self) -> None:
        """Remove the warnings that hold no longer."""
        for warning, holds in tuple(self._warnings):
            if warning.has_expired or not holds():
                self._warnings.remove((warning, holds))
                self._unnotify(warning)

    async def run_action(
        self,
        action: "str | ActionParseResult",
        default_namespace: DOMNode | None = None,
        namespaces: Mapping[str, DOMNode] | None = None,
    ) -> bool:
        """Run an action, whether from key, mouse or palette; in a view-only app the gate may refuse it."""
        if not self.may(default_namespace or self, action, namespaces):
            self.notify(VIEW_ONLY_WORDS, severity="warning")
            return True
        return await super().run_action(action, default_namespace, namespaces)

    def may(
        self,
        node: DOMNode,
        action: "str | ActionParseResult",
        namespaces: Mapping[str, DOMNode] | None = None,
    ) -> bool:
        """Whether an action of a node may run; in a view-only app only actions that look may."""
        if not self.view_only:
            return True
        target, name, _ = self._parse_action(action, node, namespaces)
        return not GATE.refuses(target, name)

    async def do_on(self, screen: str, action: Action) -> None:
        """Open a screen and run one of its actions there; say so if the action has nothing to do there now."""
        await self.action_open(screen)
        if isinstance(self.screen, StationScreen) and self.screen.offers(action):
            await self.run_action(action.call, self.screen)
        else:
            self.notify(f"{action.words}: there is nothing for it to do on {self.screen.title} now")

    def get_key_display(self, binding: Binding) -> str:
        """A key as pages and sentences write it too: `Ctrl-U`, `Home`."""
        modifier, _, key = binding.key.rpartition("+")
        if modifier == "ctrl" and len(key) == 1:
            return f"Ctrl-{key.upper()}"
        shown = super().get_key_display(binding)
        return shown.capitalize() if len(shown) > 1 and shown.isalpha() else shown

    def delay_update(self, delay: float = SETTLES_S) -> None:
        """Hold drawing back while screens change. Textual's own time is half of that in which a key is answered."""
        super().delay_update(delay)

    async def action_open(self, screen: str) -> None:
        """Show a screen and close anything opened over the last screen. The next key already goes to the new screen."""
        if not self.is_running:
            return
        self.action_close()
        await self.switch_mode(screen)
        self.call_after_refresh(self._show)

    async def action_begin(self, screen: str) -> None:
        """Show a screen and start its work at once."""
        await self.action_open(screen)
        if self.is_running and isinstance(self.screen, StationScreen):
            self.screen.begin()

    def action_force_off(self) -> None:
        """Force the feed-forward off without asking. The order uses the recording's links; begin one if none runs."""
        self._views.force_off()
        self._off_may_record = True
        if not self._views.view().records:
            self._record_for_off()
        self._show()

    def _starts_recording(self) -> bool:
        """Whether the app is about to begin a recording."""
        return any(worker.group == "record" and not worker.is_finished for worker in self.workers)

    def _record_for_off(self) -> None:
        """Begin the recording that carries the off order, once for each key press."""
        if self._off_may_record and self.desk.record is not None and not self._starts_recording():
            self._off_may_record = False
            self.run_worker(self._record(self.desk.record), group="record", exclusive=True)

    def action_raise_ff(self) -> None:
        """Ask for the words that raise the feed-forward by one step, if its gate lets it."""
        view = self._views.view()
        mode, why = raised_to(read_situation(self.desk, view))
        if mode is None or self.desk.jobs.runs(ORDER):
            self.notify(f"not raised: {why or BEING_SET}", severity="warning")
            return

        def asked() -> str:
            armed = self._views.view().picture.armed is not Armed.DISARMED
            return f"{ARMED} {mode.word.upper()}" if armed else mode.word.upper()

        def answered(typed: str | None) -> None:
            if typed is not None and agrees(typed, asked()):
                self._send_mode(mode, view)
            elif typed is not None:
                self.notify(f"'{typed}' is not {asked()}: nothing was sent", severity="warning")

        title = (
            f"Type {asked()} to set the feed-forward of vehicle {view.picture.links[0].system} to {mode.word}"
        )
        self.push_screen(AskScreen(title, "sends it"), answered)

    def action_lower_ff(self) -> None:
        """Set a feed-forward that acts to shadow, without asking: less of it is the safer mode."""
        view = self._views.view()
        mode, why = lowered_to(read_situation(self.desk, view))
        if mode is None or self.desk.jobs.runs(ORDER):
            self.notify(f"not lowered: {why or BEING_SET}", severity="warning")
            return
        self._send_mode(mode, view)
        self.notify(f"vehicle {view.picture.links[0].system} is being set to {mode.word}")

    def action_end_flight(self) -> None:
        """The end key of the flight that runs."""
        jobs = self.desk.jobs
        flight = flight_of(jobs)
        if not jobs.press(FLY):
            self.notify("no flight runs that was begun here; Off, sticks and disarming work as always")
        elif flight is Flight.UNDER_WAY:
            self._warn(
                "the flight is ended: it holds its place; again disarms it",
                lambda: flight_of(jobs) is Flight.UNDER_WAY,
            )
        else:
            self._warn("the work on the flight is ended", lambda: jobs.runs(FLY))

    def _send_mode(self, mode: Mode, view: View) -> None:
        """Set the feed-forward of the vehicle on screen."""
        system = str(view.picture.links[0].system)
        self.desk.jobs.start(ORDER, (ORDER, mode.word, "--yes", "--system", system))
        self._ordered = self.desk.jobs.state(ORDER)

    def _tell_ordered(self) -> None:
        """Say how an order to set the feed-forward ended."""
        state = self.desk.jobs.state(ORDER)
        if self._ordered is None or state is None or state.done is None:
            return
        self._ordered = None
        done = state.done.code == exit_codes.DONE
        words = (
            f"in {state.done.result['mode']}, as the vehicle says" if done else f"not set: {state.done.why}"
        )
        self.notify(f"feed-forward {words}", severity="information" if done else "error", timeout=TELL_S)

    async def action_quit(self) -> None:
        """Leave the app; refused while parameters are being written, and asked twice while a long verb runs.

        Verbs end with the app.
        """
        jobs = self.desk.jobs
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
        at_work = self._at_work()
        if at_work <= self._warned_of:
            self.exit()
            return
        self._warned_of |= at_work
        verbs = " and ".join(sorted(verb for verb, _ in at_work))
        leaves = self._key_of_id("app.quit")
        self._warn(
            f"{verbs} at work, and lost if you leave now; {leaves} again leaves",
            lambda: bool(at_work & self._at_work()),
        )

    def action_help_quit(self) -> None:
        """Ctrl-C ends nothing here: say which key leaves."""
        goes_on = "; the recording goes on" if self._views.view().records else ""
        self.notify(f"{self._key_of_id('app.quit')} leaves{goes_on}")

    def _at_work(self) -> set[tuple[str, float]]:
        """The long verbs that run, each with its start time."""
        jobs = self.desk.jobs
        return {(verb, state.began_s) for verb in LONG if (state := jobs.state(verb)) and state.runs}

    def action_record(self) -> None:
        if self.desk.record is None:
            self.notify(
                "the app was started with --unrecorded; leave it and start it without", severity="error"
            )
        elif self._views.view().records:
            self.notify("a recording runs already")
        elif not self.desk.links() and self.desk.connect is not None:
            self.action_connect()
        else:
            self.run_worker(self._record(self.desk.record), group="record", exclusive=True)

    async def _record(self, record: Callable[[], None]) -> None:
        """Begin a recording, and announce it with the key that declines it."""
        try:
            await aside(record)
        except SeatrialError as error:
            self._warn(
                f"nothing is recorded: {error}", lambda: not self._views.view().records, "error", TELL_S
            )
            return
        self._declinable_until_s = self._clock() + ANNOUNCED_S
        of = f" of {', '.join(self.desk.links())}" if self.desk.links() else ""
        self.notify(
            f"a recording{of} has begun, and goes on when the app is left; "
            f"{self._key_of_id('recording.decline')} ends it again, and only looks",
            timeout=TELL_S,
        )

    def action_decline(self) -> None:
        """End the recording that the app has just begun, and look at its link without one."""
        end, begun = self.desk.end_recording, self.desk.recorded()
        if end is None or begun is None or self._clock() > self._declinable_until_s:
            self.notify("the app has begun no recording just now; nothing was ended")
            return
        self._declinable_until_s, self._off_may_record = -math.inf, False
        self.run_worker(self._decline(end, self.desk.links()), group=ORDERS)

    async def _decline(self, end: Callable[[], Path], links: tuple[str, ...]) -> None:
        await self._order(end, "NOTHING is recorded any more")
        if self.desk.connect is not None and links and self.desk.recorded() is None:
            await self._go(Choice(links[0], records=False), self.desk.connect)

    def action_connect(self) -> None:
        """Ask by which way, and go it."""
        connect = self.desk.connect
        if connect is None or isinstance(self.screen, ConnectScreen):
            return

        def answered(choice: Choice | None) -> None:
            if choice is not None:
                self.run_worker(self._go(choice, connect), group="record", exclusive=True)

        self.push_screen(ConnectScreen(self.desk.ways()), answered)

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

    async def _go(self, choice: Choice, connect: Callable[[Choice], None]) -> None:
        """Go a way: where that begins a recording, say so."""
        if choice.records and self.desk.recorded() is None:
            await self._record(partial(connect, choice))
        else:
            try:
                await aside(partial(connect, choice))
            except SeatrialError as error:
                self.notify(str(error), severity="error", timeout=TELL_S)
                return
            how = "shows the recording of" if choice.records else "looks at, and does not record,"
            self.notify(f"the app {how} {choice.link}")
        await self.action_open(SCREENS[0].id)

    def action_next_dive(self) -> None:
        """Let the recording go on in a new folder, without a question, since nothing is lost either way."""
        if self.desk.next_dive is None or not self._views.view().records:
            self.notify(f"{NOTHING_RUNS}{self._begins()}", severity="error")
        elif not any(worker.group == ORDERS and not worker.is_finished for worker in self.workers):
            self.run_worker(self._order(self.desk.next_dive, "the next dive is recorded"), group=ORDERS)

    def action_end_recording(self) -> None:
        end, recorded = self.desk.end_recording, self.desk.recorded()
        if end is None or recorded is None or not self._views.view().records:
            self.notify(f"{NOTHING_RUNS}{self._begins()}", severity="error")
            return

        def answered(typed: str | None) -> None:
            if typed is not None and self.desk.recorded() != recorded:
                self.notify(f"the recording of {recorded.name} is over already; nothing was ended")
            elif typed is not None and agrees(typed, END):
                self._off_may_record = False
                self.run_worker(self._order(end, "NOTHING is recorded any more"), group=ORDERS)
            elif typed is not None:
                self.notify(f"'{typed}' is not {END}: the recording goes on", severity="warning")

        title = f"Type {END} to end the recording of {recorded.name}"
        self.push_screen(AskScreen(title, "ends it, and the link with it"), answered)

    async def _order(self, order: Callable[[], Path], after: str) -> None:
        desk, worked, chosen = self.desk, bool(self._at_work()), self.desk.dive
        # The next recording may be seen before the order has its answer.
        self._news.ordered = desk.recorded()
        try:
            finished = await aside(order)
        except SeatrialError as error:
            self._news.ordered = None
            self.notify(str(error), severity="error", timeout=TELL_S)
            return
        if not worked and not self._at_work() and desk.dive == chosen:
            # The finished dive is now the newest finished dive, which the screens show by default.
            desk.dive = desk.param = None
        elif desk.dive is not None:
            after += f"; the screens stay on {desk.dive.name}"
        self._news.ordered = finished
        became = "is finished" if finished.exists() else "is not kept, since nothing arrived in it"
        self.notify(f"{finished.name} {became}; {after}")

    def action_command_palette(self) -> None:
        if not isinstance(self.screen, ActionPalette):
            self.push_screen(ActionPalette(id="--command-palette"))

    def action_help(self) -> None:
        """Show the keys that work here."""
        if not isinstance(self.screen, HelpScreen):
            self.push_screen(HelpScreen(help_lines(self, self.screen)))

    def action_next_theme(self) -> None:
        self.action_use_theme(themes.next_theme(self.theme))

    def action_use_theme(self, name: str) -> None:
        self.theme = name
        if not self.view_only:
            self._keep_theme(name)

    def action_close(self) -> None:
        """Close the overlay, or whatever the screen itself has opened."""
        if isinstance(self.screen, HelpScreen):
            self.screen.dismiss()
        elif isinstance(self.screen, StationScreen):
            self.screen.close_up()

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
        return row.make(row.title, tabs(row.id, self._key_of))

    def _key_of(self, action: Action) -> str:
        keys = self._keys.get(action.id, action.keys)
        return self.get_key_display(Binding(keys.split(",")[0], "", ""))

    def key_of_action(self, action_id: str) -> str:
        return next(self._key_of(action) for place in PLACES for action in place if action.id == action_id)

    def _key_of_id(self, action_id: str) -> str:
        return next(self._key_of(action) for action in EVERYWHERE if action.id == action_id)

    def _refresh_view(self) -> None:
        now_s = self._clock()
        self._tell_recording()
        self._watch_over_off()
        self._tell_ordered()
        self._take_back_warnings()
        if self._pace.may_draw(now_s):
            self._show()
            if isinstance(self._driver, AnsweringDriver) and self._pace.may_ask():
                self._pace.on_asked(now_s)
                self.call_after_refresh(self._driver.ask)
        period_s = self._pace.period_s(now_s)
        self._views.set_period(period_s)
        self.call_later(self.next_key)
        self.set_timer(period_s, self._refresh_view)

    def _watch_over_off(self) -> None:
        """Begin a recording if it died before off was acknowledged, or had died unnoticed before the key press.

        Not if it was ended in order: whoever ended it may need the link.
        """
        view = self._views.view()
        if view.forcing is not None and not view.forcing.done and not view.records and not self._news.is_over:
            self._record_for_off()

    def _tell_recording(self) -> None:
        """Show the notices on the recording."""
        ours = self._starts_recording() or self._clock() <= self._declinable_until_s
        for notice in self._news.take(self._views.view(), ours=ours, flies=self.desk.jobs.runs(FLY)):
            if notice.is_lost:
                self._warn(notice.words, lambda: self._views.view().recording is None, "error", TELL_S)
            else:
                self.notify(notice.words, timeout=TELL_S)

    def _next_dive(self) -> str:
        """End of a sentence: which key records the next dive; "" if none can."""
        if self.desk.record is None or self.view_only:
            return ""
        return f"; {self._key_of_id('recording.begin')} records the next"

    def _begins(self) -> str:
        """End of a sentence: which key begins a recording; "" if none can."""
        if self.desk.record is None or self.view_only:
            return ""
        if not self.desk.links() and self.desk.connect is not None:
            return f"; {self._key_of_id('link.connect')} connects one"
        return f"; {self._key_of_id('recording.begin')} begins one"

    def _situation(self, view: View) -> Situation:
        """The situation, read once a second at most, and as soon as an alarm comes or goes."""
        now_s, alarms = self._clock(), tuple(alarm.key for alarm in view.alarms)
        if self._step is None or now_s >= self._step[0] + LOOK_EVERY_S or alarms != self._step[1]:
            self._step = (now_s, alarms, read_situation(self.desk, view))
        return self._step[2]

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
        view, for_step = self._news.seen(self._views.view())
        situation = self._situation(for_step)
        view = replace(view, situation=situation, next=next_of(situation), view_only=self.view_only)
        if events := self._alarm_notes.take(self._bell.hear(view.alarms, view.picture.now_s), view):
            self.run_worker(self._note(events), group="notes")
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
