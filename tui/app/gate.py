"""The gate of a view-only app: of our own actions only those run that the table marks as looking.

What is not marked is refused, so that an action that is new is refused until somebody has thought of it.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Final

from textual.actions import parse

from tui import exit_codes, job
from tui.app.actions import Action
from tui.job import Done
from tui.told import Told

OURS: Final = "tui."
UNLISTED: Final = frozenset({"use_theme"})
"""What the palette alone calls, and only changes how this screen looks."""

LOOKING_VERBS: Final = frozenset({"dives"})
"""It lists what is there. What it keeps beside a dive only saves reading that again."""


class Gate:
    """Made from the actions of all screens."""

    def __init__(self, actions: Iterable[Action]) -> None:
        self._looking = UNLISTED | {name_of(action) for action in actions if action.looks}

    def refuses(self, target: object, name: str) -> bool:
        """Whether `target`'s action of that name must not run. What Textual brings, such as scrolling, may."""
        method = getattr(target, f"_action_{name}", None) or getattr(target, f"action_{name}", None)
        return getattr(method, "__module__", "").startswith(OURS) and name not in self._looking


async def looking_work(words: Sequence[str], hear: Callable[[Told], None]) -> Done:
    """`tui.job.work` for a view-only app: of all verbs those alone that look."""
    if words[0] in LOOKING_VERBS:
        return await job.work(words, hear)
    return Done(exit_codes.NO, None, (f"VIEW ONLY: seatrial {words[0]} is not run from here",))


def name_of(action: Action) -> str:
    """The method that an action calls, without `action_`."""
    return parse(action.call)[1]
