"""Watch: the vehicle's present motion, the health of its sensors, and its messages; or a recorded dive in its place."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import ClassVar

from textual import events
from textual.app import ComposeResult
from textual.containers import Container, Vertical, VerticalScroll

from gcs_plugin.watch.picture import Condition, Freshness, LinkRow, Picture
from tui.app.drawing import Lines, cut, heading, wrapped
from tui.app.header import Tab
from tui.app.keys import HIDDEN, LOOKS, Action, bindings
from tui.app.screens.frame import Drawn, StationScreen
from tui.app.screens.strip_chart import QUANTITIES, Quantity, chart
from tui.app.screens.watch_lines import (
    gap_lines,
    replay_line,
    sensors,
    thrusters,
    thrusters_heading,
    unset_lines,
    words,
    worst,
)
from tui.app.view import View

MOTION = {"u": "first", "v": "first", "w": "first", "p": "second", "q": "second", "r": "first"}
STATE = {"depth": "first", "heading": "second", "altitude": "mini", "voltage": "mini", "current": "second"}
"""The charts and, for a small screen, their place: on the first page, on the second, or in one row on both."""
SUPPLY = ("voltage", "current")
HIGH = 40
"""The charts that stand below the words on a wide screen of that many rows, where the others then have theirs."""
_OF_REPLAY = HIDDEN | LOOKS
REPLAYING = (
    Action("replay.end", "l", "Live", "end the replay, and show the vehicle", LOOKS, "replay_end"),
    Action("replay.pause", "space", "Pause", "pause the replay, or go on", _OF_REPLAY, "replay_pause"),
    Action("replay.back", "b", "-10 s", "10 s back in the replay", _OF_REPLAY, "replay_seek(-10)"),
    Action("replay.on", "f", "+10 s", "10 s on in the replay", _OF_REPLAY, "replay_seek(10)"),
    Action("replay.far_back", "B", "-60 s", "a minute back in the replay", _OF_REPLAY, "replay_seek(-60)"),
    Action("replay.far_on", "F", "+60 s", "a minute on in the replay", _OF_REPLAY, "replay_seek(60)"),
    Action(
        "replay.slower", "minus", "Slower", "half the speed of the replay", _OF_REPLAY, "replay_speed(-1)"
    ),
    Action(
        "replay.faster",
        "plus,equals_sign",
        "Faster",
        "twice the speed of the replay",
        _OF_REPLAY,
        "replay_speed(1)",
    ),
)


class WatchScreen(StationScreen):
    """Charts at the left, sensors and thrusters at the right, messages below."""

    ACTIONS: ClassVar[tuple[Action, ...]] = (
        Action("watch.identify", "i", "Identify", "identify the last dive, or what there is of it"),
        Action("watch.charts", "c", "Charts", "the other charts, where not all fit", LOOKS),
        Action("watch.words", "w", "Words", "all that the vehicle said last, and back", LOOKS),
        *REPLAYING,
    )
    BINDINGS = bindings(ACTIONS)  # type: ignore[assignment]
    LEGEND: ClassVar[tuple[tuple[str, str], ...]] = (
        ("●", "ok"),
        ("◐", "degraded: it comes too slowly, or says little"),
        ("▲", "bad: it says nothing that can be used"),
        ("○", "missing: expected and never heard; dimmed: not heard yet"),
        ("4 s ago", "older than 3 of its periods: dimmed, and dated"),
        ("--", "older than 10 of its periods, or no number"),
        ("░", "a gap in a chart; the dotted line is the reference"),
        ("ALARM", "a limit was passed; ~/.config/seatrial/alarms.yaml sets it"),
        ("REPLAY", "below it a recorded dive, above it the vehicle"),
    )

    def __init__(self, title: str, tabs: Sequence[Tab]) -> None:
        super().__init__(title, tabs)
        self.add_class("-first", update=False)

    def body(self) -> ComposeResult:
        yield Drawn(self._replay_bar, id="replay-bar")
        with Container(id="middle"):
            with Container(id="charts"):
                for name, title, keys in (("motion", "VELOCITIES", MOTION), ("state", "STATE", STATE)):
                    with Vertical(id=name):
                        yield self._heading(title, self._span)
                        yield from (self._chart(QUANTITIES[key], page) for key, page in keys.items())
            with Vertical(id="aside"):
                yield self._heading("SENSORS")
                with VerticalScroll(id="sensors-scroll"):
                    yield self._pane(self._sensors, id="sensors")
                with Vertical(id="thrusters-pane"):
                    yield self._pane(
                        lambda now, cells, _: (thrusters_heading(now.configuration, cells),),
                        classes="heading",
                    )
                    yield self._pane(lambda now, cells, _: thrusters(now.thrusters, cells), id="thrusters")
                yield self._pane(self._gap, id="gap")
            with Vertical(id="words-pane"):
                yield self._heading("WORDS", self._words_note)
                with VerticalScroll(id="words-scroll"):
                    yield self._pane(lambda now, cells, _: words(now.said, cells), id="words")
                with Vertical(id="supply"):
                    yield self._heading("SUPPLY", self._span)
                    yield from (self._chart(QUANTITIES[key], "", "beside-") for key in SUPPLY)

    def _pane(
        self, make: Callable[[Picture, int, int], Lines], *, id: str | None = None, classes: str | None = None
    ) -> Drawn:
        def lines(cells: int, rows: int) -> Lines:
            return make(self._picture, cells, rows) if self._picture is not None else ((),)

        return Drawn(lines, id=id, classes=classes)

    def _heading(self, title: str, note: Callable[[Picture], str] = lambda _: "") -> Drawn:
        return self._pane(lambda now, cells, _: (heading(title, note(now), cells),), classes="heading")

    def _span(self, _: Picture) -> str:
        return f"{'its ' * self._is_over}last 60 s"

    def _chart(self, quantity: Quantity, page: str, place: str = "") -> Drawn:
        def lines(now: Picture, cells: int, rows: int) -> Lines:
            last = self.view.last_heard if self.view is not None else None
            if not self._is_over or last is None:
                return chart(quantity, now.traces.get(quantity.key), now.now_s, cells, rows)
            trace = last.traces.get(quantity.key)
            if trace is not None:
                age_s = trace.age_s + now.now_s - last.now_s
                trace = replace(trace, age_s=age_s, freshness=Freshness.STALE)
            return chart(quantity, trace, last.now_s, cells, rows)

        return self._pane(lines, id=f"{place}chart-{quantity.key}", classes=f"chart {page}")

    def _replay_bar(self, cells: int, _: int) -> Lines:
        replayed = self.view.replay if self.view is not None else None
        if replayed is None:
            return ()
        return (replay_line(replayed, cells), ((cut(f" {self._replay_keys()}", cells), "quiet"),))

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        if action == "identify":
            return self.desk.replay is None
        if action == "charts":
            return not (self.has_class("-wide") or self.has_class("-words"))
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

    @property
    def _picture(self) -> Picture | None:
        """The picture on display: during a replay the dive's, under a line that says so."""
        if self.view is None:
            return None
        return self.view.picture if self.view.replay is None else self.view.replay.picture

    def _sensors(self, now: Picture, cells: int, _: int) -> Lines:
        """All sensors; on a phone only the links and those not ok. None once the dive is over."""
        if self._is_over:
            links = sensors(self._links(now), (), cells)
            return (*links, *wrapped("the dive is over: nothing is measured", "quiet", cells))
        if not (self.has_class("-phone") and self.has_class("-first")):
            return (*sensors(self._links(now), now.sensors, cells), *unset_lines(now.unset, cells))
        faults = tuple(row for row in now.sensors if row.condition is not Condition.OK)
        good = len(now.sensors) - len(faults)
        ok: Lines = (((f"● {good} ok", "quiet"),),) if good else ()
        return (*sensors((), faults, cells), *ok)

    def _links(self, now: Picture) -> tuple[LinkRow, ...]:
        """The links, but for those that fell silent because the dive is over."""
        return tuple(link for link in now.links if not (self._is_over and link.lost))

    @property
    def _is_over(self) -> bool:
        """Whether the dive shown is one that has just ended."""
        return self.view is not None and self.view.over and self.view.replay is None

    def _gap(self, now: Picture, cells: int, _: int) -> Lines:
        return gap_lines(now.gap, now.lacks, cells, now.links[0].age_s if now.links else 0.0)

    def show(self, view: View) -> None:
        if self.has_class("-replay") != (view.replay is not None):
            self.set_class(view.replay is not None, "-replay")
            self.refresh_bindings()
        super().show(view)

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
        groups = (("pause",), ("back", "on"), ("far_back", "far_on"), ("slower", "faster"), ("end",))
        words = ("pause", "10 s", "60 s", "speed", "live")
        keys = (" ".join(self.key_of(f"replay.{name}") for name in group) for group in groups)
        return "   ".join(f"{key} {word}" for key, word in zip(keys, words, strict=True))

    def close_up(self) -> None:
        if self.has_class("-words"):
            self.action_words()
        elif self.desk.replay is not None:
            self.action_replay_end()

    def on_resize(self, event: events.Resize) -> None:
        self.set_class(event.size.height >= HIGH, "-high")
        self.refresh_bindings()

    def _words_note(self, now: Picture) -> str:
        return "  ".join(filter(None, (worst(now.said), f"[{self.key_of('watch.words')}]")))
