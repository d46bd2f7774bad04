"""Estimate of the longest round trip to the vehicle, from the answers so far: the least quiet period. Pure.

A PARAM_VALUE does not say which message it answers: the echo of a write looks like the answer to a read request. Only
time separates them. For each parameter, the time from the first request to its first answer counts, and only if the
request was repeated at most once: that time is an upper bound of the round trip. A link that seldom answers so soon may
be slow as well as lossy; so the smaller the share of requests answered soon, and the fewer answers there are, the
longer the quiet period.
"""

from typing import Final

from gcs_plugin.params.deadline import Timing

MARGIN: Final = 2.0
UNSEEN: Final = 15  # unanswered requests that are assumed in addition, so that the first answers weigh little
SOON_SENDS: Final = 2


class RoundTrips:
    """Round trips of requests and answers, by parameter name; `quiet_s` is the quiet period that follows from them.

    If the round trips are uniformly distributed, up to at most `quiet_max_s`, no answer is older than `quiet_s`. Until
    an answer came soon, `quiet_s` is `quiet_max_s`.
    """

    def __init__(self, timing: Timing) -> None:
        self._timing = timing
        self._first_s: dict[str, float] = {}
        self._sends: dict[str, int] = {}
        self._answered: set[str] = set()
        self._longest_s = 0.0

    @property
    def known(self) -> bool:
        """Whether any request was answered soon (within SOON_SENDS sends)."""
        return bool(self._answered)

    @property
    def quiet_s(self) -> float:
        """Quiet period, s: after it, an answer can't belong to an earlier write or request."""
        if not self._answered:
            return self._timing.quiet_max_s
        seldom = (len(self._first_s) + UNSEEN) / len(self._answered)
        return min(max(MARGIN * self._longest_s * seldom, self._timing.quiet_s), self._timing.quiet_max_s)

    def on_sent(self, name: str, time_s: float) -> None:
        """A write or read request of that name was sent."""
        self._first_s.setdefault(name, time_s)
        self._sends[name] = self._sends.get(name, 0) + 1

    def on_quiet(self, name: str) -> None:
        """Nothing of that name is under way: unless a request was answered soon, the next counts as the first."""
        if name not in self._answered:
            self._first_s.pop(name, None)
            self._sends.pop(name, None)

    def on_heard(self, name: str, time_s: float) -> None:
        """A PARAM_VALUE of that name arrived."""
        if name in self._answered or not 1 <= self._sends.get(name, 0) <= SOON_SENDS:
            return
        self._answered.add(name)
        self._longest_s = max(self._longest_s, time_s - self._first_s[name])
