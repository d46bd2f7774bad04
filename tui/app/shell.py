"""The shell of the app: desk and views, screens opened and closed, notices and warnings, keys in words, the gate."""

from collections.abc import Callable, Mapping

from textual.actions import ActionParseResult
from textual.binding import Binding
from textual.dom import DOMNode
from textual.notifications import Notification, Notify, SeverityLevel

from tui.app.desk import Desk
from tui.app.key_queue import KeyQueue
from tui.app.keys import EVERYWHERE, Action, Gate, Keymap
from tui.app.read_situation import LONG
from tui.app.screens.frame import StationScreen
from tui.app.screens.overlays import HelpScreen
from tui.app.screens.table import PLACES
from tui.app.terminal import AnsweringDriver
from tui.app.view import Views
from tui.show import harmless

GATE = Gate(action for place in PLACES for action in place)
SETTLES_S = 0.01
VIEW_ONLY_WORDS = "VIEW ONLY: nothing is done from here"


class Shell(KeyQueue):
    """The part of the app that its other parts stand on.

    `desk` holds the work that the screens share, `views` makes the views to show. `view_only`: the user may look but
    not act.
    """

    def __init__(
        self,
        views: Views,
        keymap: Keymap | None,
        driver: type[AnsweringDriver] | None,
        desk: Desk | None,
        view_only: bool,
        clock: Callable[[], float],
    ) -> None:
        super().__init__(driver)
        self.desk = desk or Desk()
        self.view_only = view_only
        self._views, self._clock, self._keys = views, clock, keymap or {}
        self._warnings: list[tuple[Notification, Callable[[], bool]]] = []

    def _show(self) -> None:
        """Show the present view on the screens that are open."""
        raise NotImplementedError

    def notify(
        self,
        message: str,
        *,
        title: str = "",
        severity: SeverityLevel = "information",
        timeout: float | None = None,
        markup: bool = False,
    ) -> None:
        """Show a notification literally: markup in a name has no effect."""
        super().notify(harmless(message), title=title, severity=severity, timeout=timeout, markup=markup)

    def _warn(
        self,
        message: str,
        holds: Callable[[], bool],
        severity: SeverityLevel = "warning",
        timeout: float | None = None,
    ) -> None:
        """Warn, and take the warning back as soon as it holds no longer."""
        shown = self.NOTIFICATION_TIMEOUT if timeout is None else timeout
        warning = Notification(harmless(message), severity=severity, timeout=shown, markup=False)
        self._warnings.append((warning, holds))
        self.post_message(Notify(warning))

    def _take_back_warnings(self) -> None:
        """Remove the warnings that hold no longer."""
        for warning, holds in tuple(self._warnings):
            # A warning that has not reached the screen yet stays until it can be removed there.
            if warning.has_expired or (warning in self._notifications and not holds()):
                self._warnings.remove((warning, holds))
                self._unnotify(warning)

    async def run_action(
        self,
        action: "str | ActionParseResult",
        default_namespace: DOMNode | None = None,
        namespaces: Mapping[str, DOMNode] | None = None,
    ) -> bool:
        """Run an action, whether from key, mouse or palette; in a view-only app the gate may refuse it."""
        if not self.may(default_namespace or self, action, namespaces):
            self.notify(VIEW_ONLY_WORDS, severity="warning")
            return True
        return await super().run_action(action, default_namespace, namespaces)

    def may(
        self,
        node: DOMNode,
        action: "str | ActionParseResult",
        namespaces: Mapping[str, DOMNode] | None = None,
    ) -> bool:
        """Whether an action of a node may run; in a view-only app only actions that look may."""
        if not self.view_only:
            return True
        target, name, _ = self._parse_action(action, node, namespaces)
        return not GATE.refuses(target, name)

    def get_key_display(self, binding: Binding) -> str:
        """A key as pages and sentences write it too: `Ctrl-U`, `Home`."""
        modifier, _, key = binding.key.rpartition("+")
        if modifier == "ctrl" and len(key) == 1:
            return f"Ctrl-{key.upper()}"
        shown = super().get_key_display(binding)
        return shown.capitalize() if len(shown) > 1 and shown.isalpha() else shown

    def delay_update(self, delay: float = SETTLES_S) -> None:
        """Hold drawing back while screens change. Textual's own time is half of that in which a key is answered."""
        super().delay_update(delay)

    async def action_open(self, screen: str) -> None:
        """Show a screen and close anything opened over the last screen. The next key already goes to the new screen."""
        if not self.is_running:
            return
        self.action_close()
        await self.switch_mode(screen)
        self.call_after_refresh(self._show)

    async def action_begin(self, screen: str) -> None:
        """Show a screen and start its work at once."""
        await self.action_open(screen)
        if self.is_running and isinstance(self.screen, StationScreen):
            self.screen.begin()

    def action_close(self) -> None:
        """Close the overlay, or whatever the screen itself has opened."""
        if isinstance(self.screen, HelpScreen):
            self.screen.dismiss()
        elif isinstance(self.screen, StationScreen):
            self.screen.close_up()

    def _key_of(self, action: Action) -> str:
        keys = self._keys.get(action.id, action.keys)
        return self.get_key_display(Binding(keys.split(",")[0], "", ""))

    def key_of_action(self, action_id: str) -> str:
        return next(self._key_of(action) for place in PLACES for action in place if action.id == action_id)

    def _key_of_id(self, action_id: str) -> str:
        return next(self._key_of(action) for action in EVERYWHERE if action.id == action_id)

    def _at_work(self) -> set[tuple[str, float]]:
        """The long verbs that run, each with its start time."""
        jobs = self.desk.jobs
        return {(verb, state.began_s) for verb in LONG if (state := jobs.state(verb)) and state.runs}
