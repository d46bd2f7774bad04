"""Watch: what the vehicle does now, how healthy its sensors are, and what it said."""

from collections.abc import Sequence
from typing import ClassVar

from textual import events
from textual.app import ComposeResult
from textual.containers import Container, Horizontal, Vertical, VerticalScroll

from tui.app import panes
from tui.app.actions import Action, bindings
from tui.app.header import Tab
from tui.app.quantities import QUANTITIES
from tui.app.screens.frame import StationScreen
from tui.app.view import View
from tui.app.widgets.panes import Heading, SensorTable, ThrusterBars, Words
from tui.app.widgets.strip_chart import StripChart

MOTION = {"u": "first", "v": "first", "w": "first", "p": "second", "q": "second", "r": "first"}
STATE = {"depth": "first", "heading": "second", "altitude": "mini", "voltage": "mini", "current": "second"}
"""The charts, and where there is little room: on the first page, on the second, or in one row on both."""


class WatchScreen(StationScreen):
    """Charts at the left, sensors and thrusters at the right, words below."""

    ACTIONS: ClassVar[tuple[Action, ...]] = (
        Action("watch.charts", "c", "charts", "Charts", "the other charts, where not all fit", looks=True),
        Action("watch.words", "w", "words", "Words", "all that the vehicle said last, and back", looks=True),
    )
    BINDINGS = bindings(ACTIONS)  # type: ignore[assignment]
    LEGEND: ClassVar[tuple[tuple[str, str], ...]] = (
        ("●", "ok"),
        ("◐", "degraded: it comes too slowly, or says little"),
        ("▲", "bad: it says nothing that can be used"),
        ("○", "missing: the vehicle file names it, and it was never heard"),
        ("4 s ago", "older than 3 of its periods: dimmed, and dated"),
        ("--", "older than 10 of its periods, or no number"),
        ("░", "a gap in a chart; the dotted line is the reference"),
    )

    def __init__(self, title: str, tabs: Sequence[Tab]) -> None:
        super().__init__(title, tabs)
        self.add_class("-first")

    def body(self) -> ComposeResult:
        with Horizontal(id="middle"):
            with Container(id="charts"):
                for name, title, keys in (("motion", "VELOCITIES", MOTION), ("state", "STATE", STATE)):
                    with Vertical(id=name):
                        yield Heading(title, lambda _: "last 60 s")
                        yield from (StripChart(QUANTITIES[key], classes=page) for key, page in keys.items())
            with Vertical(id="aside"):
                yield Heading("SENSORS")
                with VerticalScroll(id="sensors-scroll"):
                    yield SensorTable()
                with Vertical(id="thrusters-pane"):
                    yield Heading("THRUSTERS", lambda view: view.picture.configuration)
                    yield ThrusterBars()
        with Vertical(id="words-pane"):
            yield Heading("WORDS", self._words_note)
            with VerticalScroll(id="words-scroll"):
                yield Words()

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        if action == "charts":
            return self.has_class("-narrow") and not self.has_class("-words")
        return super().check_action(action, parameters)

    def action_charts(self) -> None:
        self.toggle_class("-first")
        self.toggle_class("-second")

    def action_words(self) -> None:
        self.toggle_class("-words")
        self.refresh_bindings()

    def close_up(self) -> None:
        if self.has_class("-words"):
            self.action_words()

    def on_resize(self, _: events.Resize) -> None:
        self.refresh_bindings()

    def _words_note(self, view: View) -> str:
        return "  ".join(filter(None, (panes.worst(view.picture.said), f"[{self.key_of('watch.words')}]")))
