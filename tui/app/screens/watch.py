"""Watch: the vehicle's present motion, the health of its sensors, and its messages; or a recorded dive in its place."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import ClassVar

from textual import events
from textual.app import ComposeResult
from textual.containers import Container, Horizontal, Vertical, VerticalScroll

from tui.app.drawing import Line, Lines, cut, stopwatch
from tui.app.header import Tab
from tui.app.keys import HIDDEN, LOOKS, Action, bindings
from tui.app.screens import panes
from tui.app.screens.frame import LineView, StationScreen, TopLine
from tui.app.screens.panes import Heading, SensorTable, ThrusterBars, ThrusterHeading, Words
from tui.app.screens.strip_chart import QUANTITIES, StripChart
from tui.app.view import Replayed, View

MOTION = {"u": "first", "v": "first", "w": "first", "p": "second", "q": "second", "r": "first"}
STATE = {"depth": "first", "heading": "second", "altitude": "mini", "voltage": "mini", "current": "second"}
"""The charts and, for a small screen, their place: on the first page, on the second, or in one row on both."""
REPLAYING = tuple(
    Action(f"replay.{name}", keys, f"replay_{call}", words, sentence, mark)
    for name, keys, call, words, sentence, mark in (
        ("end", "l", "end", "Live", "end the replay, and show the vehicle", LOOKS),
        ("pause", "space", "pause", "Pause", "pause the replay, or go on", HIDDEN | LOOKS),
        ("back", "b", "seek(-10)", "-10 s", "10 s back in the replay", HIDDEN | LOOKS),
        ("on", "f", "seek(10)", "+10 s", "10 s on in the replay", HIDDEN | LOOKS),
        ("far_back", "B", "seek(-60)", "-60 s", "a minute back in the replay", HIDDEN | LOOKS),
        ("far_on", "F", "seek(60)", "+60 s", "a minute on in the replay", HIDDEN | LOOKS),
        ("slower", "minus", "speed(-1)", "Slower", "half the speed of the replay", HIDDEN | LOOKS),
        ("faster", "plus,equals_sign", "speed(1)", "Faster", "twice the speed of the replay", HIDDEN | LOOKS),
    )
)


def replay_line(replayed: Replayed, cells: int) -> Line:
    """The line that marks the lines below it as a replay and not the live vehicle."""
    clock = f"{stopwatch(replayed.at_s)} of {stopwatch(replayed.length_s)}"
    speed = "  PAUSED" if replayed.paused else f"  {replayed.speed:g}x"
    left, right = f" REPLAY {replayed.name}", f"{clock}{speed:<8} "
    live = "  only the lines above are live"
    if len(left) + len(live) + len(right) + 2 <= cells:
        left += live
    left = cut(left, max(cells - len(right) - 2, 0))
    return ((f"{left}{right:>{max(cells - len(left), 0)}}", "lost"),)


class ReplayBar(LineView):
    """Two lines; `keys` returns the keys that work."""

    def __init__(self, keys: Callable[[], str]) -> None:
        super().__init__(id="replay-bar")
        self._keys = keys

    def lines(self, view: View, cells: int, rows: int) -> Lines:
        del rows
        if view.replay is None:
            return ()
        return (replay_line(view.replay, cells), ((cut(f" {self._keys()}", cells), "quiet"),))


class WatchScreen(StationScreen):
    """Charts at the left, sensors and thrusters at the right, messages below."""

    ACTIONS: ClassVar[tuple[Action, ...]] = (
        Action(
            "watch.identify", "i", "identify", "Identify", "identify the last dive, or what there is of it"
        ),
        Action("watch.charts", "c", "charts", "Charts", "the other charts, where not all fit", LOOKS),
        Action("watch.words", "w", "words", "Words", "all that the vehicle said last, and back", LOOKS),
        *REPLAYING,
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
        ("REPLAY", "below it a recorded dive, above it the vehicle"),
    )

    def __init__(self, title: str, tabs: Sequence[Tab]) -> None:
        super().__init__(title, tabs)
        self.add_class("-first")

    def body(self) -> ComposeResult:
        yield ReplayBar(self._replay_keys)
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
                    yield ThrusterHeading()
                    yield ThrusterBars()
        with Vertical(id="words-pane"):
            yield Heading("WORDS", self._words_note)
            with VerticalScroll(id="words-scroll"):
                yield Words()

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        if action == "identify":
            return self.desk.replay is None
        if action == "charts":
            return self.has_class("-narrow") and not self.has_class("-words")
        if action.startswith("replay_"):
            return self.desk.replay is not None
        return super().check_action(action, parameters)

    async def action_identify(self) -> None:
        await self.begin_on("dives")

    def action_charts(self) -> None:
        self.toggle_class("-first", "-second")

    def action_words(self) -> None:
        self.toggle_class("-words")
        self.refresh_bindings()

    def show(self, view: View) -> None:
        """Show the vehicle, or during a replay the dive under a line that says so. The lines on top stay live."""
        replayed = view.replay
        if self.has_class("-replay") != (replayed is not None):
            self.set_class(replayed is not None, "-replay")
            self.refresh_bindings()
        super().show(view)
        if replayed is not None:
            below = replace(view, picture=replayed.picture)
            for widget in self.query(LineView):
                if not isinstance(widget, TopLine | ReplayBar):
                    widget.show(below)

    def action_replay_end(self) -> None:
        self.desk.replay = None
        if self.view is not None:
            self.show(replace(self.view, replay=None))

    def action_replay_pause(self) -> None:
        if self.desk.replay is not None:
            self.desk.replay.toggle()

    def action_replay_seek(self, by_s: float) -> None:
        if self.desk.replay is not None:
            self.desk.replay.seek(by_s)

    def action_replay_speed(self, steps: int) -> None:
        if self.desk.replay is not None:
            self.desk.replay.faster(steps)

    def _replay_keys(self) -> str:
        """The present keys of the replay."""
        groups = (("pause",), ("back", "on"), ("far_back", "far_on"), ("slower", "faster"), ("end",))
        words = ("pause", "10 s", "60 s", "speed", "live")
        keys = (" ".join(self.key_of(f"replay.{name}") for name in group) for group in groups)
        return "   ".join(f"{key} {word}" for key, word in zip(keys, words, strict=True))

    def close_up(self) -> None:
        if self.has_class("-words"):
            self.action_words()
        elif self.desk.replay is not None:
            self.action_replay_end()

    def on_resize(self, _: events.Resize) -> None:
        self.refresh_bindings()

    def _words_note(self, view: View) -> str:
        return "  ".join(filter(None, (panes.worst(view.picture.said), f"[{self.key_of('watch.words')}]")))
