"""The screens, one row each. Their keys, tabs, palette entries and keymap ids follow from it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from tui.app.actions import EVERYWHERE, Action
from tui.app.header import Tab
from tui.app.screens.ask import ASKING
from tui.app.screens.diagnose import DiagnoseScreen
from tui.app.screens.dives import DivesScreen
from tui.app.screens.form import FILLING
from tui.app.screens.frame import StationScreen
from tui.app.screens.help import CLOSING
from tui.app.screens.identify import IdentifyScreen
from tui.app.screens.parameters import ParametersScreen
from tui.app.screens.validate import ValidateScreen
from tui.app.screens.watch import WatchScreen


@dataclass(frozen=True)
class Row:
    """A screen: its id, key, title and purpose, the function that makes it, and its actions."""

    id: str
    key: str
    title: str
    sentence: str
    make: Callable[[str, Sequence[Tab]], StationScreen]
    actions: tuple[Action, ...]


SCREENS: Final = (
    Row(
        "watch",
        "1",
        "Watch",
        "the vehicle as it is now, and its sensors' health",
        WatchScreen,
        WatchScreen.ACTIONS,
    ),
    Row(
        "dives",
        "2",
        "Dives",
        "the recordings, and what each could identify",
        DivesScreen,
        DivesScreen.ACTIONS,
    ),
    Row(
        "identify",
        "3",
        "Identify",
        "masses and dampings that the chosen dive tells",
        IdentifyScreen,
        IdentifyScreen.ACTIONS,
    ),
    Row(
        "diagnose",
        "4",
        "Diagnose",
        "where model and recording differ, what causes it, how far that shrinks it",
        DiagnoseScreen,
        DiagnoseScreen.ACTIONS,
    ),
    Row(
        "parameters",
        "5",
        "Parameters",
        "the vehicle beside what was identified; upload and roll back",
        ParametersScreen,
        ParametersScreen.ACTIONS,
    ),
    Row(
        "validate",
        "6",
        "Validate",
        "may the feed-forward be raised, and how well the vehicle followed",
        ValidateScreen,
        ValidateScreen.ACTIONS,
    ),
)
OPENING: Final = tuple(
    Action(
        f"screen.{row.id}",
        row.key,
        f"app.open('{row.id}')",
        row.title,
        row.sentence,
        in_footer=False,
        looks=True,
    )
    for row in SCREENS
)
PLACES: Final = (
    *((*EVERYWHERE, *OPENING, *row.actions) for row in SCREENS),
    # Keys that close the help may open it elsewhere; a line that is typed into takes letters for itself.
    *(
        (*(action for action in EVERYWHERE if action.always), *closing)
        for closing in (CLOSING, ASKING, FILLING)
    ),
)
"""Groups of actions that are live together."""


def tabs(shown: str, keys: Callable[[Action], str]) -> tuple[Tab, ...]:
    """The titles, with the key that opens each, and a mark on the screen shown."""
    return tuple(
        Tab(keys(action), row.title, row.id == shown) for row, action in zip(SCREENS, OPENING, strict=True)
    )
