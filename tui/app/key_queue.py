"""A queue of keys: each key reaches a screen only after the previous key has taken effect.

Textual sends a key to the widget that has the focus at that moment, and the effect travels through the queues of all
its ancestors: keys that a slow link delivers in one burst would otherwise go to the line or screen that was just left.
"""

import time
from collections import deque
from functools import partial
from typing import ClassVar, Final

from textual import events
from textual.app import App
from textual.driver import Driver
from textual.message import Message

KEY_PATIENCE_S: Final = 1.0
"""The next key waits no longer than this: if its widget disappears, a key never reports that it took effect."""


class KeyBehind(Message):
    """Follows a key through the same queues, so that it arrives after the key has taken effect."""

    def __init__(self, turn: int) -> None:
        super().__init__()
        self.turn = turn


class KeyQueue(App[None]):
    """An app that gives its screens one key at a time; keys of the bindings in `AT_ONCE` do not wait in the queue."""

    AT_ONCE: ClassVar[frozenset[str]] = frozenset()

    def __init__(self, driver: type[Driver] | None) -> None:
        super().__init__(driver_class=driver)
        self._typed: deque[events.Key] = deque()
        self._turn = 0
        self._given_s: float | None = None

    @property
    def is_typing(self) -> bool:
        """Whether a key is still waiting or has yet to take effect."""
        return self.is_running and (self._given_s is not None or bool(self._typed))

    async def on_event(self, event: events.Event) -> None:
        """Queue keys; keys typed after the key that leaves the app find no screen, and are dropped."""
        if not isinstance(event, events.InputEvent):
            await super().on_event(event)
        elif not (self.screen_stack and self.is_running):
            self._typed.clear()
        elif isinstance(event, events.Key) and not event.is_forwarded and not self._is_at_once(event.key):
            self._typed.append(event)
            await self.next_key()
        else:
            await super().on_event(event)

    async def next_key(self) -> None:
        """Give the next waiting key to the screen unless a key is under way. Also call this regularly: a key whose
        widget has disappeared never completes by itself.
        """
        now_s = time.monotonic()
        if not self._typed or (self._given_s is not None and now_s - self._given_s < KEY_PATIENCE_S):
            return
        event = self._typed.popleft()
        target = self.focused or self.screen
        self._turn += 1
        turn, self._given_s = self._turn, now_s
        await super().on_event(event)
        if not target.post_message(KeyBehind(turn)):
            await self._over(turn)

    async def on_key_behind(self, message: KeyBehind) -> None:
        """The key has taken effect; whatever it opened exists once the screen is drawn."""
        over = partial(self._over, message.turn)
        if not (self.screen_stack and self.screen.call_after_refresh(over)):
            await over()

    async def _over(self, turn: int) -> None:
        if turn != self._turn:
            return
        self._given_s = None
        if self.screen_stack and self.is_running:
            await self.next_key()

    def _is_at_once(self, key: str) -> bool:
        return any(
            binding.id in self.AT_ONCE
            for _, bindings in self.screen._binding_chain
            for binding in bindings.key_to_bindings.get(key, ())
        )
