"""Every action in the command palette, from the same table as keys and help."""

from collections.abc import Callable, Iterator
from functools import partial

from textual.command import DiscoveryHit, Hit, Hits, Provider

from tui.app import themes
from tui.app.actions import EVERYWHERE, Action
from tui.app.screens.frame import StationScreen
from tui.app.screens.table import OPENING


class ActionProvider(Provider):
    """The actions that are live on the screen that the palette was opened from, and each theme by its name."""

    def _actions(self) -> Iterator[Action]:
        yield from (action for action in EVERYWHERE if action.id != "app.palette")
        yield from OPENING
        if isinstance(self.screen, StationScreen):
            yield from (action for action in self.screen.ACTIONS if self.screen.offers(action))
        for name in themes.ORDER:
            yield Action(f"theme.{name}", "", f"app.use_theme('{name}')", f"Theme: {name}", "use this theme")

    async def discover(self) -> Hits:
        for action in self._actions():
            yield DiscoveryHit(action.words, self._command(action), help=self._help(action))

    async def search(self, query: str) -> Hits:
        matcher = self.matcher(query)
        for action in self._actions():
            score = max(matcher.match(action.words), 0.9 * matcher.match(action.sentence))
            if score > 0:
                yield Hit(
                    score, matcher.highlight(action.words), self._command(action), help=self._help(action)
                )

    def _help(self, action: Action) -> str:
        """What it does, and its key."""
        key = self.screen.key_of(action.id) if isinstance(self.screen, StationScreen) else ""
        return f"{action.sentence} ({key})" if key else action.sentence

    def _command(self, action: Action) -> Callable[[], object]:
        return partial(self.app.run_action, action.call, self.screen)
