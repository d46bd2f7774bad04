"""Common base of all screens and widgets: the lines on top, the live keys at the bottom, the view in between."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest
from typing import TYPE_CHECKING, ClassVar, Final, cast

from rich.segment import Segment
from rich.style import Style
from textual import events, on
from textual.app import ComposeResult
from textual.binding import ActiveBinding
from textual.geometry import Region, Size
from textual.screen import Screen
from textual.strip import Strip
from textual.widget import Widget
from textual.widgets import Input, Static

from tui.app.desk import Desk
from tui.app.drawing import Line, Lines, Role, changed, harmless, with_head
from tui.app.header import PHONE, Tab, header, tab_at
from tui.app.keys import EVERYWHERE, Action
from tui.app.next_step import ASKED
from tui.app.themes import ROLE_CLASSES
from tui.app.view import View

if TYPE_CHECKING:
    from tui.app.app import SeatrialApp

NOT_UNDERLINED: Final = Style(underline=False)

NEVER_LEFT_OUT = ("app.force_off", "app.help")
"""Actions that must be visible on any terminal."""
HELP = "app.help"


class Drawn(Widget):
    """Shows the lines of `make(cells, rows)`; `again` draws those cells that have changed since.

    `pressed(x, y)` is called at a click on a cell. The screen holds the roles' component classes.
    """

    def __init__(
        self,
        make: Callable[[int, int], Lines],
        *,
        id: str | None = None,
        classes: str | None = None,
        pressed: Callable[[int, int], object] | None = None,
    ) -> None:
        super().__init__(id=id, classes=classes)
        self._make, self._pressed = make, pressed
        self._lines: Lines = ()

    def again(self) -> None:
        if not self.size.width or not self.is_on_screen:
            return
        before, self._lines = self._lines, self._make(self.size.width, self.size.height)
        if len(before) != len(self._lines) and self.styles.auto_dimensions:
            self.refresh(layout=True)
            return
        for y, (old, new) in enumerate(zip_longest(before, self._lines, fillvalue=())):
            if old != new:
                # Redraw only the changed digits: on a slow link, they are a tenth of the row.
                start, end = changed(old, new)
                self.refresh(Region(start, y, end - start, 1))

    def get_content_height(self, container: Size, viewport: Size, width: int) -> int:
        del container, viewport
        made = self._make(width, 0)
        if not self._lines:
            # Else the first drawing would be empty, and a key's answer would wait for the second.
            self._lines = made
        return len(made)

    def render_line(self, y: int) -> Strip:
        base = self.rich_style
        spans = self._lines[y] if y < len(self._lines) else ()
        segments = [segment for text, role in spans for segment in self._segments(text, role)]
        return Strip(segments).adjust_cell_length(self.size.width, base)

    def _segments(self, text: str, role: Role) -> Iterator[Segment]:
        """Segments of one span; leading and trailing blanks are not underlined."""
        text = harmless(text)
        style = self.screen.get_component_rich_style(f"line--{role}")
        bare = text.strip() if style.underline else text
        before, _, after = text.partition(bare) if bare else (text, "", "")
        unmarked = style + NOT_UNDERLINED
        yield from (
            Segment(part, kind)
            for part, kind in ((before, unmarked), (bare, style), (after, unmarked))
            if part
        )

    def on_resize(self, _: events.Resize) -> None:
        self._lines = self._make(self.size.width, self.size.height)
        # A hidden widget returns with its old height, though its number of lines may have changed.
        self.refresh(layout=bool(self.styles.auto_dimensions and len(self._lines) != self.size.height))

    def on_show(self, _: events.Show) -> None:
        self.again()

    def on_click(self, event: events.Click) -> None:
        if self._pressed is not None:
            self._pressed(event.x, event.y)


class TopLine(Drawn):
    """Armed state, link, recording, feed-forward, UTC; the screens, each opened by a click on it; alerts."""

    def __init__(self, tabs: Sequence[Tab], view: Callable[[], View | None]) -> None:
        super().__init__(self._made, pressed=self._open)
        self._tabs, self._view = tabs, view

    def _made(self, cells: int, _: int) -> Lines:
        view = self._view()
        return header(view, self._tabs, cells) if view is not None else ()

    def _open(self, x: int, y: int) -> None:
        view = self._view()
        tab = tab_at(view, self._tabs, self.size.width, x, y) if view is not None else None
        if tab is not None:
            self.call_later(self.app.run_action, f"app.open('{tab.title.lower()}')")


@dataclass(frozen=True)
class LiveKey:
    """A key that has an effect now: its name in Textual, its display form, its words, and the action."""

    name: str
    written: str
    words: str
    action: str

    @property
    def spans(self) -> Line:
        return ((f" {self.written} ", "key"), (f"{self.words} ", "quiet"))

    @property
    def cells(self) -> int:
        return sum(len(text) for text, _ in self.spans)


def fitting(keys: Sequence[LiveKey], cells: int) -> tuple[LiveKey, ...]:
    """Drop keys from the end until the rest fits into `cells`; those in `NEVER_LEFT_OUT` are never dropped.

    The help key tells how many were dropped, in a shorter form if that keeps the first key.
    """
    shown = _fitting(keys, cells, ", {} more")
    shorter = _fitting(keys, cells, " +{}")
    return shorter if shorter[:1] == tuple(keys[:1]) != shown[:1] else shown


def _fitting(keys: Sequence[LiveKey], cells: int, more: str) -> tuple[LiveKey, ...]:
    last_first = [key for key in reversed(keys) if key.action not in NEVER_LEFT_OUT]
    for count in range(len(last_first) + 1):
        shown = tuple(_telling(key, count, more) for key in keys if key not in last_first[:count])
        if sum(key.cells for key in shown) <= cells:
            break
    return shown


def _telling(key: LiveKey, left_out: int, more: str) -> LiveKey:
    """The key, or for the help key a version that shows how many keys are left out."""
    if left_out and key.action == HELP:
        return replace(key, words=f"{key.words}{more.format(left_out)}")
    return key


class KeyLine(Drawn):
    """All keys in a single widget: a widget per key, as in Textual's footer, makes changing screens slow."""

    ALLOW_SELECT = False

    def __init__(self) -> None:
        super().__init__(self._made, pressed=self._press)

    def on_mount(self) -> None:
        self.screen.bindings_updated_signal.subscribe(self, lambda _: self.again())

    def on_unmount(self) -> None:
        self.screen.bindings_updated_signal.unsubscribe(self)

    def _press(self, x: int, _: int) -> None:
        end = 0
        for key in fitting(tuple(self._live()), self.size.width):
            end += key.cells
            if x < end:
                self.app.simulate_key(key.name)
                return

    def _made(self, cells: int, _: int) -> Lines:
        return (tuple(span for key in fitting(tuple(self._live()), cells) for span in key.spans),)

    def _live(self) -> Iterator[LiveKey]:
        """The keys of the footer, the first key of each action: below a question or a form those alone that its line
        does not take."""
        seen = set()
        typed = self.app.screen is not self.screen or isinstance(self.app.focused, Input)
        for _, binding, enabled, _ in self.screen.active_bindings.values():
            if typed and not binding.priority:
                continue
            if binding.show and enabled and binding.action not in seen:
                seen.add(binding.action)
                yield LiveKey(
                    binding.key, self.app.get_key_display(binding), binding.description, binding.action
                )


class StationScreen(Screen[None]):
    """Base of the screens. Subclasses give a body, their actions, and a legend that explains their marks."""

    COMPONENT_CLASSES: ClassVar[set[str]] = set(ROLE_CLASSES)
    ACTIONS: ClassVar[tuple[Action, ...]] = ()
    LEGEND: ClassVar[tuple[tuple[str, str], ...]] = ()
    HORIZONTAL_BREAKPOINTS = [(0, "-phone"), (PHONE, "-narrow"), (140, "-wide")]  # noqa: RUF012 (Textual's own type)
    VERTICAL_BREAKPOINTS = [(0, "-short"), (34, "-tall")]  # noqa: RUF012

    def __init__(self, title: str, tabs: Sequence[Tab]) -> None:
        super().__init__()
        self.title = title
        self._tabs = tabs
        self.view: View | None = None
        self._styled = ""

    def fit(self, size: Size) -> None:
        """Take on the classes of a terminal of this size before the screen is mounted: with those that come later every
        widget's styles are found twice."""
        for cells, bounds in (
            (size.width, self.HORIZONTAL_BREAKPOINTS),
            (size.height, self.VERTICAL_BREAKPOINTS),
        ):
            _, name = max(bound for bound in bounds or () if cells >= bound[0])
            self.add_class(name, update=False)

    @on(events.ScreenResume)
    def _style(self, event: events.ScreenResume) -> None:
        """Find the styles of every widget anew only if the theme is another one by now: that takes a third of a key's
        time."""
        event.refresh_styles, self._styled = self._styled not in ("", self.app.theme), self.app.theme

    @property
    def _station_app(self) -> "SeatrialApp":
        return cast("SeatrialApp", self.app)

    @property
    def desk(self) -> Desk:
        """State that the screens share."""
        return self._station_app.desk

    @property
    def view_only(self) -> bool:
        """Whether this app may not start anything, so that no sentence may name a key that would."""
        return self._station_app.view_only

    @property
    def active_bindings(self) -> dict[str, ActiveBinding]:
        """Bindings that have an effect now, in the order of the table: a keymap does not reorder footer and help."""
        may = self._station_app.may
        place = {action.id: n for n, action in enumerate((*self.ACTIONS, *EVERYWHERE))}
        live = [
            (key, active)
            for key, active in super().active_bindings.items()
            if may(active.node, active.binding.action)
        ]
        return dict(sorted(live, key=lambda live: place.get(live[1].binding.id or "", len(place))))

    def compose(self) -> ComposeResult:
        yield TopLine(self._tabs, lambda: self.view)
        yield Static(id="room")
        yield from self.body()
        yield Drawn(self._next, id="next")
        yield Static(id="notices")
        yield KeyLine()

    def _next(self, cells: int, _: int) -> Lines:
        """The next step and its keys, on as many rows as that needs."""
        step = self.view.next if self.view is not None else None
        if step is None:
            return ((),)
        step = ASKED if isinstance(self.app.focused, Input) else step
        here = f"screen.{str(self.title).lower()}"
        keys = [self._station_app.key_of_action(name) for name in step.actions if name != here]
        named: Line = ((f" {' '.join(keys)} ", "key"),) if keys and not self.view_only else ()
        head: Line = ((" NEXT ", "accent"), *named, (" ", "plain"))
        return with_head(head, step.words, "strong", cells)

    def body(self) -> ComposeResult:
        yield from ()

    def offers(self, action: Action) -> bool:
        return bool(self.check_action(action.call, ()))

    def begin(self) -> None:
        """Start the screen's work on the chosen dive."""

    async def begin_on(self, screen: str) -> None:
        """Open another screen, and start its work at once."""
        await self._station_app.action_begin(screen)

    def close_up(self) -> None:
        """Close whatever the screen itself has opened."""

    def make_room(self, rows: int) -> None:
        """Start the content at row `rows`, below an overlay; 0 if there is none."""
        taken = max((top.region.bottom for top in self.query(TopLine)), default=0)
        for room in self.query("#room"):
            room.styles.height = max(rows - taken, 0)

    def keep_free(self, rows: int) -> None:
        """Keep the last `rows` above the keys free for notices."""
        for notices in self.query("#notices"):
            notices.styles.height = rows

    def show(self, view: View) -> None:
        self.view = view
        self.draw()

    def draw(self) -> None:
        """Draw all changed widgets; nothing before the first view."""
        if self.view is not None:
            for widget in self.query(Drawn):
                widget.again()

    def key_of(self, action_id: str) -> str:
        """Display form of the action's key now; "" if it has none."""
        of_action = (
            active.binding for active in self.active_bindings.values() if active.binding.id == action_id
        )
        return next((self.app.get_key_display(binding) for binding in of_action), "")
