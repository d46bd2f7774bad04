"""docs/reference/keys.md: the keys of the terminal app, from its table of actions."""

from collections.abc import Iterable

from docs.make.markdown import MADE, code, table
from tui.app.keys import EVERYWHERE, Action
from tui.app.screens.table import OPENING, PLACES, SCREENS

HEAD = ("keys", "action", "what it does")


def page() -> str:
    known = {action.id for action in (*EVERYWHERE, *OPENING)}
    known |= {action.id for row in SCREENS for action in row.actions}
    others = [action for place in PLACES for action in place if action.id not in known]
    screens = "".join(f"## {row.title}\n\n{row.sentence}\n\n{_table(row.actions)}\n" for row in SCREENS)
    return (
        f"# Keys of the terminal app\n\n{MADE} Names of keys are Textual's. Other keys: "
        "`~/.config/seatrial/keymap.yaml`, by action, as `configs/keymap.yaml` has them.\n\n"
        f"## Everywhere\n\n{_table((*EVERYWHERE, *OPENING))}\n{screens}"
        f"## Over a screen\n\n{_table(dict.fromkeys(others))}"
    )


def _table(actions: Iterable[Action]) -> str:
    rows = (
        (", ".join(map(code, action.keys.split(","))), code(action.id), f"{action.words}: {action.sentence}")
        for action in actions
    )
    return table(HEAD, rows)
