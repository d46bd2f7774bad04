"""Verbs that answer at once or once they are let go, in place of processes, and the desk that they work for."""

import asyncio
from pathlib import Path

from made_dives import DIVES, OUT

from tui.app.desk import Desk
from tui.app.jobs import Done, Jobs


class FakeVerbs:
    """Each verb tells `tells` and ends with what `results` holds of it, or with what `results(words)` says.

    A verb in `held`, or without a result, waits for `go` first. `leave(words)` writes the files that a verb leaves.
    """

    def __init__(self, results=None, code=0, errors=(), tells=(), held=(), leave=lambda _: None, names=()):
        self.results = {"dives": DIVES} if results is None else results
        self.code, self.errors, self.names = code, tuple(errors), tuple(names)
        self.tells, self.held, self.leave = tells, held, leave
        self.words, self.go, self._waiting = [], asyncio.Event(), 0

    @property
    def waiting(self):
        """How many verbs wait to be let go."""
        return 0 if self.go.is_set() else self._waiting

    def _waits(self, words):
        return words[0] in self.held or (not callable(self.results) and words[0] not in self.results)

    async def __call__(self, words, hear, pressed=None):
        self.words.append(words)
        self.pressed = pressed
        for report in self.tells if words[0] != "dives" else ():
            hear(report)
        if self._waits(words):
            self._waiting += 1
            try:
                await self.go.wait()
            finally:
                self._waiting -= 1
        self.leave(words)
        result = self.results(words) if callable(self.results) else self.results.get(words[0])
        return Done(self.code, result, errors=self.errors, error_names=self.names)


def let_go(app):
    """A step that lets all verbs go on that wait."""
    app.desk.jobs._work.go.set()


def desk(verbs=None, *, now_s=lambda: 0.0, vehicle="ruvifist:hovering", out: Path = OUT, **options):
    return Desk(vehicle, out, jobs=Jobs(verbs or FakeVerbs(), now_s), **options)
