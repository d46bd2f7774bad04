"""Identify: one key runs both methods on the chosen dive; shows their progress, then the result."""

from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar, Final

from textual.app import ComposeResult
from textual.containers import VerticalScroll

from bridge import exit_codes
from bridge.reports import Report
from tui.app.drawing import Lines, hanging, heading
from tui.app.header import Tab
from tui.app.jobs import JobState
from tui.app.keys import LOOKS, Action, bindings
from tui.app.screens.frame import Drawn, StationScreen
from tui.app.screens.identify_lines import (
    Identified,
    curves,
    ended,
    load_identified,
    passes_of,
    places,
    progress,
    result,
    words_for,
)
from tui.app.view import View

VERB: Final = "identify"


class IdentifyScreen(StationScreen):
    """Bars and curves while it runs; then the result, even while its page is being written. A key shows the curves."""

    ACTIONS: ClassVar[tuple[Action, ...]] = (
        Action("identify.begin", "i", "Identify", "identify the chosen dive, now"),
        Action("identify.parameters", "p", "Parameters", "compare and upload what was found"),
        Action("identify.curves", "c", "Curves", "how the values converged, and back", LOOKS),
        Action("identify.cancel", "x", "Cancel", "end the identification that runs"),
    )
    BINDINGS = bindings(ACTIONS)  # type: ignore[assignment]
    LEGEND: ClassVar[tuple[tuple[str, str], ...]] = (
        ("⠤⠤ ⠁⠁", "the value after each pass, and dotted the ends of its 95 % interval"),
        ("vs", "what the other method says, which has answered already"),
        (
            "accepted",
            "what the vehicle last accepted; the change is warned of where it is outside the interval",
        ),
        ("▲", "a doubt: read it before the values are used"),
    )

    def __init__(self, title: str, tabs: Sequence[Tab]) -> None:
        super().__init__(title, tabs)
        self._dive: Path | None = None
        self._shown: Identified | None = None
        self._seen: JobState | None = None
        self._refused = ""
        self._curves = False
        self._offered: object = None
        self._then = False

    def body(self) -> ComposeResult:
        yield Drawn(self._progress, id="identify-progress")
        yield Drawn(self._charts, id="identify-curves")
        with VerticalScroll(id="identify-scroll"):
            yield Drawn(self._result, id="identify-result")

    def on_screen_resume(self) -> None:
        self._look()

    def on_screen_suspend(self) -> None:
        if self._then and self.desk.jobs.runs(VERB):
            self.notify("Parameters opens no more by itself: Identify was left", severity="warning")
        self._then = False

    def show(self, view: View) -> None:
        state = self.desk.jobs.state(VERB)
        if state is not self._seen:
            before, self._seen = self._seen, state
            if state is not None and state.answered and (before is None or not before.answered):
                self._curves = False
                self._look()
                # Not after a failure: older values may still lie there.
                succeeded = state.unkept is None and (
                    state.done is None or state.done.code == exit_codes.DONE
                )
                if self._then and succeeded:
                    self.call_later(self.action_parameters)
                self._then = False
        self._arrange()
        super().show(view)

    def begin(self) -> None:
        """Identify the chosen dive unless an identification runs."""
        if self.check_action("begin", ()):
            self.action_begin()

    def action_begin(self) -> None:
        self._look()
        self._curves, self._refused = False, ""
        if self._dive is None:
            self._refused = self.desk.no_dive
        elif not (vehicle := self.desk.vehicle_of(self._dive)):
            self._refused = (
                f"{self._dive}: names no vehicle file that is there; start the app with --vehicle NAME"
            )
        else:
            self.desk.dive = self._dive
            self.desk.jobs.start(VERB, words_for(str(self._dive), vehicle, places(self._dive)))
        self._draw()

    def action_cancel(self) -> None:
        self.desk.jobs.cancel(VERB)
        self._draw()

    def action_curves(self) -> None:
        self._curves = not self._curves
        self._draw()

    async def action_parameters(self) -> None:
        if not self._answered:
            # The key came early, or the crew does something else meanwhile.
            self._then = True
            self._draw()
            return
        # The run may have answered since the last view, so an earlier result may be outdated.
        self._look()
        if self._shown is not None and self._shown.param is not None:
            self.desk.param = self._shown.param
            await self.begin_on("parameters")

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        runs = self.desk.jobs.runs(VERB)
        if action == "begin":
            return not runs
        if action == "cancel":
            return runs
        if action == "curves":
            return self._answered and bool(passes_of(self._reports()))
        if action == "parameters":
            return not self._answered or self._has_values
        return super().check_action(action, parameters)

    def close_up(self) -> None:
        if self._curves:
            self.action_curves()

    def _look(self) -> None:
        """Load the chosen dive and its identification."""
        self._dive = self.desk.chosen()
        if self._dive is None:
            self._shown = None
        else:
            unkept = self.desk.jobs.unkept(VERB, self._dive)
            self._shown = load_identified(self._dive, self.desk.receipts, unkept)

    def _state(self) -> JobState | None:
        return self.desk.jobs.about(VERB, self._dive)

    @property
    def _has_values(self) -> bool:
        return self._shown is not None and self._shown.param is not None

    @property
    def _answered(self) -> bool:
        """Whether no identification runs, or only its page is still being written."""
        state = self.desk.jobs.state(VERB)
        return state is None or state.answered

    def _reports(self) -> tuple[Report, ...]:
        state = self._state()
        return () if state is None else state.reports

    def _draw(self) -> None:
        self._arrange()
        self.draw()

    def _arrange(self) -> None:
        """Show the curves until the result exists or when they are asked for, otherwise the result."""
        runs, answered = self.desk.jobs.runs(VERB), self._answered
        self.set_class(not answered or self._curves, "-curves")
        self.set_class(runs and answered and not self._curves, "-writes")
        offered = (runs, answered, self._curves, self._shown)
        if offered != self._offered:
            self._offered = offered
            self.refresh_bindings()

    def _progress(self, cells: int, _: int) -> Lines:
        state = self._state()
        return () if state is None else progress(state, self.desk.jobs.now_s(), cells, self._then)

    def _charts(self, cells: int, rows: int) -> Lines:
        return curves(self._reports(), cells, rows)

    def _result(self, cells: int, _: int) -> Lines:
        state = self._state()
        lines = hanging(self._refused, "bad", cells) if self._refused else ()
        if state is not None:
            lines = (*lines, *ended(state, cells))
        if self._shown is not None:
            return (*lines, *result(self._shown, cells))
        if self._dive is None:
            return lines or hanging(self.desk.no_dive, "plain", cells)
        head = heading(self._dive.name, "", cells)
        key = self.key_of("identify.begin")
        words = "not identified yet"
        if key:
            words += f"; {key} identifies it"
        elif self.view_only:
            words += "; this view only looks, and identifies nothing"
        return (head, *lines, *hanging(words, "plain", cells))
