"""The gate of a view-only app: of the app's own actions, only those that the table marks as looking may run.

Unmarked actions are refused, so a new action is refused until somebody has considered it.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Final

from textual.actions import parse

from tui import exit_codes, job
from tui.app.actions import Action
from tui.job import Done
from tui.progress import Report

OURS: Final = "tui."
UNLISTED: Final = frozenset({"use_theme"})
"""Actions that only the palette calls, and that only change the look of this screen."""

LOOKING_VERBS: Final = frozenset({"dives"})
"""Verbs that only list. The file that `dives` keeps next to a dive merely saves reading the dive again."""


class Gate:
    """Decides which actions may run; made from the actions of all screens."""

    def __init__(self, actions: Iterable[Action]) -> None:
        self._looking = UNLISTED | {name_of(action) for action in actions if action.looks}

    def refuses(self, target: object, name: str) -> bool:
        """Whether `target`'s action of that name must not run. Textual's own actions, such as scrolling, may."""
        method = getattr(target, f"_action_{name}", None) or getattr(target, f"action_{name}", None)
        return getattr(method, "__module__", "").startswith(OURS) and name not in self._looking


async def looking_work(words: Sequence[str], hear: Callable[[Report], None]) -> Done:
    """`tui.job.work` for a view-only app: only verbs that look may run."""
    if words[0] in LOOKING_VERBS:
        return await job.work(words, hear)
    return Done(exit_codes.NO, None, (f"VIEW ONLY: seatrial {words[0]} is not run from here",))


def name_of(action: Action) -> str:
    """Name of the method that an action calls, without `action_`."""
    return parse(action.call)[1]
