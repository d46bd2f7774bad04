"""Common bases of the screens that run a verb on the chosen dive and show its result."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from textual import events
from textual.app import ComposeResult
from textual.containers import Container, Vertical, VerticalScroll

from tui.app.desk import check_dives
from tui.app.drawing import Lines, titled, wrapped
from tui.app.header import Tab
from tui.app.jobs import JobState, job_lines
from tui.app.screens.frame import Drawn, StationScreen
from tui.app.view import View


class DiveScreen(StationScreen):
    """Runs a verb on the chosen dive, `dive`, by actions that call `start` and `cancel`.

    Subclasses give the verb and its command line, and take in a new result in `look_again`.
    """

    VERB: ClassVar[str]

    def __init__(self, title: str, tabs: Sequence[Tab]) -> None:
        super().__init__(title, tabs)
        self.dive: Path | None = None
        self._seen: JobState | None = None

    def words(self, dive: Path, vehicle: str) -> tuple[str, ...]:
        """The command line that works on the dive."""
        raise NotImplementedError

    def look_again(self, *, other: bool) -> None:
        """Called when the verb has gone on or the screen appears; `other`: another dive is chosen than before."""

    @property
    def at_work(self) -> bool:
        return self.desk.jobs.runs(self.VERB)

    @property
    def job(self) -> JobState | None:
        """The verb's running job, whatever its dive, or its last one if that was of this dive."""
        return self.desk.jobs.about(self.VERB, self.dive)

    @property
    def unkept(self) -> Any:
        """The verb's new result for the dive if it could not be stored next to it; None if it could."""
        return self.desk.jobs.unkept(self.VERB, self.dive)

    @property
    def obstacle(self) -> str:
        """Why the verb can't run on the chosen dive, "" if it can."""
        if self.dive is None:
            return self.desk.no_dive
        if not self.desk.vehicle_of(self.dive):
            says = "" if self.view_only else f"; {self._station_app.key_of_action('vehicle.name')} says which"
            return f"No vehicle file is known of {self.dive.name}{says}."
        return ""

    def on_screen_resume(self) -> None:
        self.look()

    def show(self, view: View) -> None:
        state = self.desk.jobs.state(self.VERB)
        if state is not self._seen or self.desk.chosen() != self.dive:
            self._seen = state
            self.look()
        super().show(view)

    def begin(self) -> None:
        self.look()
        if self.check_action("start", ()):
            self.action_start()

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        if action == "start":
            return self.dive is not None and not self.at_work and not self.obstacle
        if action == "cancel":
            return self.at_work
        return super().check_action(action, parameters)

    def action_start(self) -> None:
        if self.dive is not None:
            # What was put on the desk before may be overtaken by what this leaves.
            self.desk.dive, self.desk.param = self.dive, None
            self.desk.jobs.start(self.VERB, self.words(self.dive, self.desk.vehicle_of(self.dive)))
            self.look()

    def action_cancel(self) -> None:
        self.desk.jobs.cancel(self.VERB)

    def look(self) -> None:
        """Update the chosen dive and its results."""
        before, self.dive = self.dive, self.desk.chosen()
        self.look_again(other=self.dive != before)
        self.refresh_bindings()
        self.draw()
        self.call_after_refresh(self.scroll_by_keys)

    def scroll_by_keys(self) -> None:
        """Let the keys that scroll go to a text that is cut off, without Tab first."""
        cut_off = [text for text in self.query(VerticalScroll) if text.focusable and text.max_scroll_y > 0]
        if cut_off and self.focused not in cut_off:
            self.set_focus(cut_off[0], scroll_visible=False)


class SectionScreen(DiveScreen):
    """A verdict on top and sections below: all at once if they fit, otherwise one at a time.

    Subclasses give the sections with their titles, and implement the methods that raise NotImplementedError; their
    action ids have the verb before the point: `VERB.start`, `VERB.section`, `VERB.cancel`. `others` are dives of the
    same vehicle and configuration, the newest first.
    """

    SECTIONS: ClassVar[dict[str, str]]

    def __init__(self, title: str, tabs: Sequence[Tab]) -> None:
        super().__init__(title, tabs)
        self.others: tuple[Path, ...] = ()
        self._names = tuple(self.SECTIONS)
        self._section = 0
        self.add_class(f"-{self._names[0]}")

    def result(self) -> Any:
        """The result that the verb left next to the dive; a false value if there is none."""
        raise NotImplementedError

    def verdict(self, cells: int) -> Lines:
        raise NotImplementedError

    def section(self, name: str, cells: int, rows: int) -> Lines:
        raise NotImplementedError

    def aim(self) -> tuple[str, str]:
        """The task in words, such as `diagnoses`, and how, with the key that changes it: `checked on DIVE; [c] ...`."""
        raise NotImplementedError

    def head(self, name: str) -> tuple[str, str]:
        """A section's title, and a note with its keys."""
        return self.SECTIONS[name], ""

    def comparable(self, dive: Path) -> tuple[Path, ...]:
        """Other dives that may be compared with a dive."""
        return check_dives(self.desk, dive)

    def on_other_dive(self) -> None:
        """Called when another dive was chosen."""

    def body(self) -> ComposeResult:
        with VerticalScroll(classes="top", can_focus=False):
            yield Drawn(self._top, id=f"{self.VERB}-top")
        with Container(id=self.VERB):
            for name in self._names:
                with Vertical(id=f"{self.VERB}-{name}", classes="section"):
                    yield Drawn(partial(self._heading, name), id=f"{self.VERB}-{name}-head")
                    with VerticalScroll():
                        yield Drawn(partial(self._lines, name), id=f"{self.VERB}-{name}-lines")

    def on_resize(self, _: events.Resize) -> None:
        self.refresh_bindings()
        self.call_after_refresh(self.scroll_by_keys)

    @property
    def awaits(self) -> bool:
        """Whether the verb works, on this dive or another, and has no answer yet: then an earlier one is not shown."""
        return self.job is not None and not self.job.answered

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        if action == "section":
            return not (self.has_class("-wide") and self.has_class("-tall"))
        return super().check_action(action, parameters)

    def action_section(self) -> None:
        self._turn_to((self._section + 1) % len(self._names))

    def _turn_to(self, section: int) -> None:
        self.remove_class(f"-{self._names[self._section]}")
        self._section = section
        self.add_class(f"-{self._names[section]}")
        self.call_after_refresh(self.draw)
        self.call_after_refresh(self.scroll_by_keys)

    def look_again(self, *, other: bool) -> None:
        # Not at each step of a verb at work, where none can be chosen: of hundreds of dives that takes long.
        if other or not self.at_work:
            self.others = self.comparable(self.dive) if self.dive is not None else ()
        if other:
            # The first section says why the verdict above is what it is.
            self._turn_to(0)
            self.on_other_dive()

    def _top(self, cells: int, _: int) -> Lines:
        if self.dive is None:
            return wrapped(self.desk.no_dive, "plain", cells)
        state = self.job
        job = job_lines(self.VERB, state, self.desk.jobs.now_s(), cells)
        if state is not None and self.awaits:
            return (*wrapped(f"{self.VERB} {Path(state.words[1]).name}", "strong", cells), *job)
        has_result = bool(self.result())
        return (
            *(self.verdict(cells) if has_result else ()),
            *job,
            *wrapped(self._offer(has_result), "plain", cells),
        )

    def _offer(self, again: bool) -> str:
        """Sentence on the key and the task that it starts; "" while it is at work."""
        assert self.dive is not None
        if self.obstacle:
            return self.obstacle
        if self.view_only:
            return f"{self.dive.name}; this view only looks, and can't {self.VERB} it."
        key = self.key_of(f"{self.VERB}.start")
        if not key:
            return ""
        does, how = self.aim()
        task = f"{does} it again" if again else f"{does} {self.dive.name}"
        return f"[{key}] {task}, {how}."

    def _heading(self, name: str, cells: int, _: int) -> Lines:
        title, note = (self.SECTIONS[name], "") if self.awaits else self.head(name)
        if self.check_action("section", ()):
            place = f"{self._names.index(name) + 1} of {len(self._names)}"
            note = f"{note}  {place}  [{self.key_of(f'{self.VERB}.section')}]".strip()
        return titled(title, note, cells)

    def _lines(self, name: str, cells: int, rows: int) -> Lines:
        if self.awaits:
            return ((("at work: the answer comes here", "quiet"),),)
        return self.section(name, cells, rows) if self.result() else ((("nothing yet", "quiet"),),)
