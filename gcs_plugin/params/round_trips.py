"""How long an answer of the vehicle may be under way, from those that came: what a quiet period must exceed. Pure.

A PARAM_VALUE does not say what it answers: the echo of a write looks like the answer to a question. Only time tells
them apart. An answer counts by its name's first question alone, and only while that was repeated once at most: its age
is then known from above. A link that seldom answers so soon may be slow as well as lossy, so that the less often it
does, and the fewer answers there are, the longer is the quiet period.
"""

from typing import Final

from gcs_plugin.params.deadline import Timing

MARGIN: Final = 2.0
UNSEEN: Final = 15  # questions without an answer that are taken for asked before the first
SOON_SENDS: Final = 2


class RoundTrips:
    """Feed it each question and each answer by its name on the wire; `quiet_s` says for how long to be quiet.

    With delays of any even spread, up to `quiet_max_s` there and back, no answer is older than `quiet_s`; where none
    came soon, `quiet_s` is `quiet_max_s`.
    """

    def __init__(self, timing: Timing) -> None:
        self._timing = timing
        self._first_s: dict[str, float] = {}
        self._sends: dict[str, int] = {}
        self._answered: set[str] = set()
        self._longest_s = 0.0

    @property
    def known(self) -> bool:
        """Whether a question was answered soon."""
        return bool(self._answered)

    @property
    def quiet_s(self) -> float:
        """For how long nothing may be written before a question is answered by nothing else."""
        if not self._answered:
            return self._timing.quiet_max_s
        seldom = (len(self._first_s) + UNSEEN) / len(self._answered)
        return min(max(MARGIN * self._longest_s * seldom, self._timing.quiet_s), self._timing.quiet_max_s)

    def on_sent(self, name: str, time_s: float) -> None:
        """A write or a question of that name was sent."""
        self._first_s.setdefault(name, time_s)
        self._sends[name] = self._sends.get(name, 0) + 1

    def on_quiet(self, name: str) -> None:
        """Nothing of that name is under way any more: its next question counts as its first, if none did yet."""
        if name not in self._answered:
            self._first_s.pop(name, None)
            self._sends.pop(name, None)

    def on_heard(self, name: str, time_s: float) -> None:
        """The vehicle said a value of that name."""
        if name in self._answered or not 1 <= self._sends.get(name, 0) <= SOON_SENDS:
            return
        self._answered.add(name)
        self._longest_s = max(self._longest_s, time_s - self._first_s[name])
