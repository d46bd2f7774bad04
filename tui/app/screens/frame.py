"""Common base of all screens: the lines on top, the live keys at the bottom, and the view in between."""

from collections.abc import Sequence
from typing import ClassVar, Protocol, cast

from textual import events
from textual.app import ComposeResult
from textual.binding import ActiveBinding
from textual.dom import DOMNode
from textual.screen import Screen
from textual.widgets import Static

from tui.app.actions import EVERYWHERE, Action
from tui.app.desk import Desk
from tui.app.header import Tab
from tui.app.themes import ROLE_CLASSES
from tui.app.view import View
from tui.app.widgets.key_line import KeyLine
from tui.app.widgets.line_view import LineView
from tui.app.widgets.top_line import TopLine


class AtDesk(Protocol):
    """The app's interface for screens."""

    desk: Desk
    view_only: bool

    async def action_begin(self, screen: str) -> None:
        """Open a screen and start its work."""
        ...

    def may(self, node: DOMNode, action: str) -> bool:
        """Whether an action of a node may run; a view-only app refuses some."""
        ...


class StationScreen(Screen[None]):
    """Base of the screens. Subclasses give a body, their actions, and a legend that explains their marks."""

    COMPONENT_CLASSES: ClassVar[set[str]] = set(ROLE_CLASSES)
    ACTIONS: ClassVar[tuple[Action, ...]] = ()
    LEGEND: ClassVar[tuple[tuple[str, str], ...]] = ()
    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (140, "-wide")]  # noqa: RUF012 (Textual's own type)
    VERTICAL_BREAKPOINTS = [(0, "-short"), (34, "-tall")]  # noqa: RUF012

    def __init__(self, title: str, tabs: Sequence[Tab]) -> None:
        super().__init__()
        self.title = title
        self._tabs = tabs
        self.view: View | None = None

    @property
    def desk(self) -> Desk:
        """State that the screens share."""
        return cast(AtDesk, self.app).desk

    @property
    def view_only(self) -> bool:
        """Whether this app may not start anything, so that no sentence may name a key that would."""
        return cast(AtDesk, self.app).view_only

    @property
    def active_bindings(self) -> dict[str, ActiveBinding]:
        """Bindings that have an effect now, in the order of the table: a keymap does not reorder footer and help."""
        may = cast(AtDesk, self.app).may
        place = {action.id: n for n, action in enumerate((*self.ACTIONS, *EVERYWHERE))}
        live = [
            (key, active)
            for key, active in super().active_bindings.items()
            if may(active.node, active.binding.action)
        ]
        return dict(sorted(live, key=lambda one: place.get(one[1].binding.id or "", len(place))))

    def compose(self) -> ComposeResult:
        yield TopLine(self._tabs)
        yield Static(id="room")
        yield from self.body()
        yield KeyLine()

    def body(self) -> ComposeResult:
        yield from ()

    def offers(self, action: Action) -> bool:
        """Whether one of its actions has an effect now."""
        return bool(self.check_action(action.call, ()))

    def begin(self) -> None:
        """Start the screen's work on the chosen dive."""

    async def begin_on(self, screen: str) -> None:
        """Open another screen, and start its work at once."""
        await cast(AtDesk, self.app).action_begin(screen)

    async def take(self, event: events.Key) -> bool:
        """Offer a key that no widget took, before any binding; return whether the screen used it."""
        del event
        return False

    def close_up(self) -> None:
        """Close whatever the screen itself has opened."""

    def make_room(self, rows: int) -> None:
        """Start the content at row `rows`, below an overlay; 0 if there is none."""
        taken = max((top.region.bottom for top in self.query(TopLine)), default=0)
        for room in self.query("#room"):
            room.styles.height = max(rows - taken, 0)

    def show(self, view: View) -> None:
        """Pass a newer view to all widgets that show it."""
        self.view = view
        for widget in self.query(LineView):
            widget.show(view)

    def key_of(self, action_id: str) -> str:
        """Display form of the action's key now; "" if it has none."""
        own_bindings = (
            active.binding for active in self.active_bindings.values() if active.binding.id == action_id
        )
        return next((self.app.get_key_display(binding) for binding in own_bindings), "")
