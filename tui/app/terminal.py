"""The terminal: keys in turn, how fast it draws, and the death of the app.

Each key reaches a screen only after the previous key has taken effect. Textual sends a key to the widget that has the
focus at that moment, and the effect travels through the queues of all its ancestors: keys that a slow link delivers in
one burst would otherwise go to the line or screen that was just left.

After each drawing the terminal gets a query for its cursor, which it answers once it has drawn everything before: then
its lag is known, and a slow terminal is drawn on less often. A terminal that never answers is assumed to keep up.
"""

import time
import traceback
from collections import deque
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, Final

from textual import events
from textual.app import App
from textual.driver import Driver
from textual.drivers.linux_driver import LinuxDriver
from textual.message import Message

from gcs_plugin.recording.state import state_file

WHERE_IS_THE_CURSOR: Final = "\x1b[6n"
LATE_S: Final = 0.5
LAGGING_PERIOD_S: Final = 1.0
CALM_S: Final = 5.0  # without a late answer, before the requested rate resumes
GIVEN_UP_S: Final = 5.0


class AnsweringDriver(LinuxDriver):
    """Driver of a terminal; `answered` is called, in the driver's thread, at each answer."""

    def __init__(self, *of_driver: Any, **named: Any) -> None:
        super().__init__(*of_driver, **named)
        self.answered: Callable[[], object] = lambda: None

    def ask(self) -> None:
        """Query the cursor; the answer comes when all earlier output is shown."""
        self.write(WHERE_IS_THE_CURSOR)

    def process_message(self, message: Message) -> None:
        if isinstance(message, events.CursorPosition):
            self.answered()
            return
        super().process_message(message)

    def _sigcont_application(self, *_: object) -> None:
        """Resume after a stop. After SIGSTOP, which gives no warning, the old threads still live: Textual would start
        more of them, and all would read the keys.
        """
        if not self._auto_restart or self._must_signal_resume:
            super()._sigcont_application()
            return
        attributes = self.attrs_before
        self._end_threads()
        super()._sigcont_application()
        self.attrs_before = attributes

    def _end_threads(self) -> None:
        self.exit_event.set()
        if self._key_thread is not None:
            self._key_thread.join()
        self.exit_event.clear()
        self.close()


class Pace:
    """`fps` is the number of refreshes a second when everything keeps up."""

    def __init__(self, fps: float) -> None:
        self._period_s = 1.0 / fps
        self._asked_s: float | None = None
        self._slow_until_s = float("-inf")
        self._ever_answered = False

    def may_ask(self) -> bool:
        """Whether the last query is answered."""
        return self._asked_s is None

    def on_asked(self, now_s: float) -> None:
        self._asked_s = now_s

    def on_answered(self, now_s: float) -> None:
        if self._asked_s is not None and now_s - self._asked_s > LATE_S:
            self._slow_until_s = now_s + CALM_S
        self._asked_s, self._ever_answered = None, True

    def may_draw(self, now_s: float) -> bool:
        """Whether the terminal is ready for more; after a long wait it is tried anyway."""
        waiting_s = 0.0 if self._asked_s is None else now_s - self._asked_s
        if waiting_s <= LATE_S or not self._ever_answered:
            return True
        self._slow_until_s = now_s + CALM_S
        if waiting_s > GIVEN_UP_S:
            self._asked_s = None
            return True
        return False

    def period_s(self, now_s: float) -> float:
        """Time to the next refresh, s."""
        if now_s < self._slow_until_s:
            return max(LAGGING_PERIOD_S, self._period_s)
        return self._period_s


def trace_file() -> Path:
    """Path of the trace; it replaces the trace of an earlier death."""
    return state_file().with_name("died.txt")


def keep_trace(error: BaseException) -> str:
    """Write the trace of an error; return a sentence that reports the death."""
    file = trace_file()
    words = " ".join(f"{type(error).__name__}: {error}".split())
    trace_words = f"what it died of is in {file}"
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("".join(traceback.format_exception(error)), encoding="utf-8")
    except OSError as unwritten:
        trace_words = f"no more is known, for {file} can't be written ({unwritten.strerror})"
    return (
        f"seatrial: the app has died ({words}); a recording goes on without it. Start it again; {trace_words}"
    )


KEY_PATIENCE_S: Final = 1.0
"""Limit for the effect of a key whose widget disappears before handling it."""


class KeyBehind(Message):
    """Follows the key through the same queues, so that it arrives after the key's effect."""

    def __init__(self, turn: int) -> None:
        super().__init__()
        self.turn = turn


class KeysInTurn(App[None]):
    """`AT_ONCE` are the bindings whose keys do not wait for other keys."""

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
