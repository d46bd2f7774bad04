"""Identify: one key runs both methods on the chosen dive; shows their progress, then the result."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar

from textual.app import ComposeResult
from textual.containers import VerticalScroll

from bridge import exit_codes
from bridge.reports import Report
from tui.app.drawing import Lines, hanging, heading
from tui.app.header import Tab
from tui.app.identification import Identified, load_identified
from tui.app.jobs import ended
from tui.app.keys import LOOKS, Action, bindings
from tui.app.screens.frame import Drawn
from tui.app.screens.identify_lines import result
from tui.app.screens.identify_progress import curves, passes_of, progress
from tui.app.screens.on_dive import DiveScreen
from tui.app.view import View
from tui.dive_list import results_beside


class IdentifyScreen(DiveScreen):
    """Bars and curves while it runs; then the result, even while its page is being written. A key shows the curves."""

    VERB = "identify"
    ACTIONS: ClassVar[tuple[Action, ...]] = (
        Action("identify.begin", "i", "Identify", "identify the chosen dive, now", call="start"),
        Action("identify.parameters", "p", "Parameters", "compare and upload what was found"),
        Action("identify.curves", "c", "Curves", "how the values converged, and back", LOOKS),
        Action("identify.cancel", "x", "Cancel", "end the identification that runs"),
    )
    BINDINGS = bindings(ACTIONS)  # type: ignore[assignment]
    LEGEND: ClassVar[tuple[tuple[str, str], ...]] = (
        ("⠤⠤ ⠁⠁", "the value after each pass, and dotted the ends of its 95 % interval"),
        ("vs", "what the other method says, which has answered already"),
        ("accepted", "the vehicle's last accepted value; ▲ where the change is outside the interval"),
        ("given", "the thrust: as Parameters shows it; the wider interval holds its error"),
        ("▲", "a doubt: read it before the values are used"),
    )

    def __init__(self, title: str, tabs: Sequence[Tab]) -> None:
        super().__init__(title, tabs)
        self._shown: Identified | None = None
        self._curves = False
        self._then = False

    def body(self) -> ComposeResult:
        yield Drawn(self._progress, id="identify-progress")
        yield Drawn(lambda cells, rows: curves(self._reports(), cells, rows), id="identify-curves")
        with VerticalScroll(id="identify-scroll"):
            yield Drawn(self._result, id="identify-result")

    def on_screen_suspend(self) -> None:
        if self._then and self.at_work:
            self.notify("Parameters opens no more by itself: Identify was left", severity="warning")
        self._then = False

    def words(self, dive: Path, vehicle: str) -> tuple[str, ...]:
        return words_for(str(dive), vehicle, results_beside(dive))

    def show(self, view: View) -> None:
        before = self._seen
        super().show(view)
        state = self._seen
        if state is not None and state.answered and (before is None or not before.answered):
            self._curves = False
            # Not after a failure: older values may still lie there.
            succeeded = state.unkept is None and (state.done is None or state.done.code == exit_codes.DONE)
            if self._then and succeeded:
                self.call_later(self.action_parameters)
            self._then = False
            self._draw()

    def action_start(self) -> None:
        self._curves = False
        super().action_start()

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
        self.look()
        if self._shown is not None and self._shown.param is not None:
            self.desk.param = self._shown.param
            await self.begin_on("parameters")

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        if action == "curves":
            return self._answered and bool(passes_of(self._reports()))
        if action == "parameters":
            return not self._answered or (self._shown is not None and self._shown.param is not None)
        return super().check_action(action, parameters)

    def close_up(self) -> None:
        if self._curves:
            self.action_curves()

    def look_again(self, *, other: bool) -> None:
        """Load the dive's identification, but not at each pass of one that runs."""
        if self.dive is None:
            self._shown = None
        elif other or self._answered:
            self._shown = load_identified(self.dive, self.desk.receipts, self.unkept)
        self._arrange()

    @property
    def _answered(self) -> bool:
        """Whether no identification runs, or only its page is still being written."""
        state = self.desk.jobs.state(self.VERB)
        return state is None or state.answered

    def _reports(self) -> tuple[Report, ...]:
        return () if self.job is None else self.job.reports

    def _draw(self) -> None:
        self._arrange()
        self.refresh_bindings()
        self.draw()

    def _arrange(self) -> None:
        """Show the curves until the result exists or when they are asked for, otherwise the result."""
        self.set_class(not self._answered or self._curves, "-curves")
        self.set_class(self.at_work and self._answered and not self._curves, "-writes")

    def _progress(self, cells: int, _: int) -> Lines:
        state = self.job
        return () if state is None else progress(state, self.desk.jobs.now_s(), cells, self._then)

    def _result(self, cells: int, _: int) -> Lines:
        lines = ended(self.VERB, self.job, cells)
        lines = (*hanging(self.obstacle, "warn", cells), *lines) if self.obstacle else lines
        if self._shown is not None:
            return (*lines, *result(self._shown, cells))
        if self.dive is None:
            return lines
        head = heading(self.dive.name, "", cells)
        words = "not identified yet"
        if key := self.key_of("identify.begin"):
            words += f"; {key} identifies it"
        elif self.view_only:
            words += "; this view only looks, and identifies nothing"
        return (head, *lines, *hanging(words, "plain", cells))


def words_for(dive: str, vehicle: str, at: Mapping[str, object]) -> tuple[str, ...]:
    """The command line of the verb: both methods, and results where `at` says."""
    targets = [word for option, path in at.items() for word in (option, str(path))]
    return ("identify", dive, "--vehicle", vehicle, *targets)
