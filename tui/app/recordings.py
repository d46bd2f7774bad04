"""The app's recordings: begun, declined, gone on with in the next dive, ended; and the link that they are of."""

import math
from collections.abc import Callable
from functools import cached_property, partial
from pathlib import Path

from bridge import text
from bridge.errors import SeatrialError
from tui.app.connecting import Choice
from tui.app.jobs import aside
from tui.app.recording_news import RecordingNews
from tui.app.screens.connect import ConnectScreen
from tui.app.screens.fly import FLY
from tui.app.screens.frame import StationScreen
from tui.app.screens.overlays import AskScreen
from tui.app.screens.parameters_transfer import agrees
from tui.app.screens.table import SCREENS
from tui.app.shell import Shell

TELL_S = 20.0
ORDERS = "orders"
ANNOUNCED_S = 60.0
END = "END"
NOTHING_RUNS = "no recording runs that the app could speak to"
ORDERED = "the recording has not answered the last order yet; wait for that"
BEGINS = "a recording begins already; wait until it runs, or says why not"


class Recordings(Shell):
    """The app's actions on recordings and links, and its notices on them."""

    _off_may_record = False
    _declinable_until_s = -math.inf
    _declinable: Path | None = None

    @cached_property
    def _news(self) -> RecordingNews:
        return RecordingNews(self.desk, self._begins, self._next_dive)

    def _tell_of_others(self) -> None:
        """Name the links of other recordings that run: the app shows another vehicle than theirs, and does not tell."""
        if self.desk.recorded() is None or self.desk.link():
            return
        ways = self.desk.ways()
        others = [way.link for way in ways if way.others]
        if others:
            shown = ", ".join(way.link for way in ways if way.recorded and not way.others)
            seen_by = " or ".join(f"`seatrial watch {text.typed('--link', link)}`" for link in others)
            self.notify(
                f"the app shows what {shown} brings; another recording runs, and its vehicle is seen by {seen_by}",
                timeout=TELL_S,
            )

    def _starts_recording(self) -> bool:
        """Whether the app is about to begin a recording."""
        return any(worker.group == "record" and not worker.is_finished for worker in self.workers)

    def _begin(self) -> None:
        """Begin a recording if this app may."""
        if self.desk.record is not None:
            self.run_worker(self._record(self.desk.record), group="record")

    def _record_for_off(self) -> None:
        """Begin the recording that carries the off order, once for each key press."""
        if self._off_may_record and not self._starts_recording():
            self._off_may_record = False
            self._begin()

    def action_record(self) -> None:
        if self.desk.record is None:
            self.notify(
                "the app was started with --unrecorded; leave it and start it without", severity="error"
            )
        elif self._views.view().records:
            self.notify("a recording runs already")
        elif self._starts_recording():
            self.notify(BEGINS)
        elif not self.desk.links() and self.desk.connect is not None:
            self.action_connect()
        else:
            self._begin()

    async def _record(self, record: Callable[[], None]) -> None:
        """Begin a recording, and announce it with the key that declines it."""
        try:
            await aside(record)
        except SeatrialError as error:
            self._warn(
                f"nothing is recorded: {error}", lambda: not self._views.view().records, "error", TELL_S
            )
            return
        self._declinable_until_s, self._declinable = self._clock() + ANNOUNCED_S, self.desk.recorded()
        of = f" of {', '.join(self.desk.links())}" if self.desk.links() else ""
        self._warn(
            f"a recording{of} has begun, and goes on when the app is left; "
            f"{self._key_of_id('recording.decline')} ends it again, and only looks",
            lambda: self._declinable is not None and self.desk.recorded() == self._declinable,
            "information",
            TELL_S,
        )

    def action_decline(self) -> None:
        """End the recording that the app has just begun, and look at its link without one."""
        end, begun = self.desk.end_recording, self.desk.recorded()
        is_ours = begun == self._declinable and self._clock() <= self._declinable_until_s
        if end is None or begun is None or not is_ours:
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
            if choice is not None and self._starts_recording():
                self.notify(f"not connected: {BEGINS}", severity="warning")
            elif choice is not None:
                self.run_worker(self._go(choice, connect), group="record")

        self.push_screen(ConnectScreen(self.desk.ways()), answered)

    async def _go(self, choice: Choice, connect: Callable[[Choice], None]) -> None:
        """Go a way: where that begins a recording, say so. Then Watch is shown, unless the crew has gone on by then."""
        mode = self.current_mode
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
        if self.current_mode == mode and isinstance(self.screen, StationScreen):
            await self.action_open(SCREENS[0].id)

    def action_next_dive(self) -> None:
        """Let the recording go on in a new folder, without a question, since nothing is lost either way."""
        if self.desk.next_dive is None or not self._views.view().records:
            self.notify(f"{NOTHING_RUNS}{self._begins()}", severity="error")
        elif not self._order_runs():
            self.run_worker(self._order(self.desk.next_dive, "the next dive is recorded"), group=ORDERS)

    def _order_runs(self) -> bool:
        """Whether the recording was told to end, or to go on in a new folder, and has not answered yet."""
        return any(worker.group == ORDERS and not worker.is_finished for worker in self.workers)

    def action_end_recording(self) -> None:
        end, recorded = self.desk.end_recording, self.desk.recorded()
        if end is None or recorded is None or not self._views.view().records:
            self.notify(f"{NOTHING_RUNS}{self._begins()}", severity="error")
            return
        if self._order_runs():
            self.notify(ORDERED)
            return

        def answered(typed: str | None) -> None:
            if typed is not None and self._order_runs():
                self.notify(ORDERED)
            elif typed is not None and self.desk.recorded() != recorded:
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

    def _watch_over_off(self) -> None:
        """Begin a recording if it died before off was acknowledged, or had died unnoticed before the key press.

        Not if it was ended in order: whoever ended it may need the link.
        """
        view = self._views.view()
        if view.forcing is not None and not view.forcing.done and not view.records and not self._news.is_over:
            self._record_for_off()

    def _tell_recording(self) -> None:
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
