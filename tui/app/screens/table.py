"""The screens, one row each, from which their keys, tabs, palette entries and keymap ids follow; and the palette."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final, cast

from textual.await_complete import AwaitComplete
from textual.command import CommandPalette, DiscoveryHit, Hit, Hits, Provider

from tui.app import themes
from tui.app.header import Tab
from tui.app.keys import EVERYWHERE, HIDDEN, LOOKS, Action
from tui.app.screens.connect import CONNECTING
from tui.app.screens.diagnose import DiagnoseScreen
from tui.app.screens.dives import DivesScreen
from tui.app.screens.fly import FlyScreen
from tui.app.screens.frame import StationScreen
from tui.app.screens.identify import IdentifyScreen
from tui.app.screens.overlays import ASKING, CLOSING, FILLING, keep_below_top
from tui.app.screens.parameters import ParametersScreen
from tui.app.screens.validate import ValidateScreen
from tui.app.screens.watch import WatchScreen

if TYPE_CHECKING:
    from tui.app.app import SeatrialApp

MOVING: Final = "replay."
"""Actions that make sense only while the user sees the replay that they move in: it ends when Watch is left."""


@dataclass(frozen=True)
class Row:
    """A screen: its key, title and purpose, and its class."""

    key: str
    title: str
    sentence: str
    make: type[StationScreen]

    @property
    def id(self) -> str:
        return self.title.lower()

    @property
    def actions(self) -> tuple[Action, ...]:
        return self.make.ACTIONS


SCREENS: Final = (
    Row("1", "Watch", "the vehicle as it is now, and its sensors' health", WatchScreen),
    Row("2", "Dives", "the recordings, and what each could identify", DivesScreen),
    Row("3", "Identify", "masses and dampings that the chosen dive tells", IdentifyScreen),
    Row(
        "4",
        "Diagnose",
        "where model and recording differ, what causes it, how far that shrinks it",
        DiagnoseScreen,
    ),
    Row("5", "Parameters", "the vehicle beside what was identified; upload and roll back", ParametersScreen),
    Row("6", "Validate", "may the feed-forward be raised, and how well the vehicle followed", ValidateScreen),
    Row("7", "Fly", "the vehicle flies by itself what calibrates it, within limits", FlyScreen),
)
OPENING: Final = tuple(
    Action(f"screen.{row.id}", row.key, row.title, row.sentence, HIDDEN | LOOKS, f"app.open('{row.id}')")
    for row in SCREENS
)
PLACES: Final = (
    *((*EVERYWHERE, *OPENING, *row.actions) for row in SCREENS),
    # Keys that close the help may open it elsewhere; a line that is typed into takes letters for itself.
    *(
        (*(action for action in EVERYWHERE if action.always), *closing)
        for closing in (CLOSING, ASKING, FILLING, CONNECTING)
    ),
)
"""Groups of actions that are live together."""


def tabs(shown: str, keys: Callable[[Action], str]) -> tuple[Tab, ...]:
    """The titles, with the key that opens each, and a mark on the screen shown."""
    return tuple(
        Tab(keys(action), row.title, row.id == shown) for row, action in zip(SCREENS, OPENING, strict=True)
    )


class ActionPalette(CommandPalette):
    """The palette, closing only once: an escape and an enter together would also close the screen below."""

    def on_mount(self) -> None:
        keep_below_top(self, "CommandPalette > Vertical")

    def dismiss(self, result: None = None) -> AwaitComplete:
        return super().dismiss(result) if self.is_current else AwaitComplete()


class ActionProvider(Provider):
    """The actions that are live on the present screen, those of the other screens, and the themes.

    An action of the present screen is listed while it has an effect; actions of other screens are listed unless they
    move a mark or a replay. In a view-only app only actions that look are listed.
    """

    def _live(self) -> Iterator[Action]:
        yield from (action for action in EVERYWHERE if action.id != "app.palette")
        yield from OPENING
        if isinstance(self.screen, StationScreen):
            yield from (action for action in self.screen.ACTIONS if self.screen.offers(action))
        for name in themes.ORDER:
            yield Action(
                f"theme.{name}", "", f"Theme: {name}", "use this theme", call=f"app.use_theme('{name}')"
            )

    def _entries(self) -> Iterator[tuple[str, str, Callable[[], object]]]:
        """Words, help and function of each action."""
        app = cast("SeatrialApp", self.app)
        for action in self._live():
            if app.may(self.screen, action.call):
                yield action.words, self._help(action), partial(app.run_action, action.call, self.screen)
        for row in SCREENS:
            if row.title == self.screen.title:
                continue
            for action in row.actions:
                elsewhere = not action.id.startswith(MOVING) and action.call.partition("(")[0] != "go"
                if elsewhere and (action.looks or not app.view_only):
                    words = f"{row.title}: {action.words}"
                    yield words, action.sentence, partial(app.do_on, row.id, action)

    async def discover(self) -> Hits:
        for words, sentence, do in self._entries():
            yield DiscoveryHit(words, do, help=sentence)

    async def search(self, query: str) -> Hits:
        matcher = self.matcher(query)
        for words, sentence, do in self._entries():
            score = max(matcher.match(words), 0.9 * matcher.match(sentence))
            if score > 0:
                yield Hit(score, matcher.highlight(words), do, help=sentence)

    def _help(self, action: Action) -> str:
        """The action's sentence, with its key."""
        key = self.screen.key_of(action.id) if isinstance(self.screen, StationScreen) else ""
        return f"{action.sentence} ({key})" if key else action.sentence
