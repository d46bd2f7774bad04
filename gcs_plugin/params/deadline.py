"""Deadlines, retry delays and the least quiet period of requests over a lossy link: pure functions of times and counts.

A PARAM_VALUE does not say which message it answers: the echo of a write looks like the answer to a read request. Only
time separates them. So the longest round trip is estimated from the answers so far. For each parameter, the time from
the first request to its first answer counts, and only if the request was repeated at most once: that time is an upper
bound of the round trip. A link that seldom answers so soon may be slow as well as lossy; so the smaller the share of
requests answered soon, and the fewer answers there are, the longer the quiet period.
"""

import math
from typing import Final

WINDOW: Final = 8
"""Requests open at once, at most."""
RETRY_S: Final = 0.5
RETRY_MAX_S: Final = 1.0
"""A request without an answer is repeated after RETRY_S, a delay that grows by half each time up to RETRY_MAX_S."""
QUIET_S: Final = 1.0
QUIET_MAX_S: Final = 10.0
"""Bounds of the quiet period between the last write and its read-back, which is longer than the longest round trip: no
late echo of the write can pass for the read-back's answer. QUIET_MAX_S if answers are not known to arrive sooner."""
DEADLINE_S: Final = 60.0
"""Least time that an upload is given."""
ASSUMED_LOSS: Final = 0.3
FAILURE_PROBABILITY: Final = 1e-4
QUIET_STAGES: Final = 4  # quiet periods of an upload that is written, refused once, committed and switched to


def retry_delay_s(attempt: int) -> float:
    """Delay between attempt number `attempt` (from 1) and the next, s."""
    return min(RETRY_S * 1.5 ** min(attempt - 1, 16), RETRY_MAX_S)


def deadline_s(requests: int) -> float:
    """Time, s, in which `requests` writes and their read-backs all succeed except with FAILURE_PROBABILITY, if the
    link loses ASSUMED_LOSS in each direction. Includes QUIET_MAX_S for each of the QUIET_STAGES of an upload.
    """
    success = (1.0 - ASSUMED_LOSS) ** 2  # the request and its answer must both arrive
    attempts = math.ceil(math.log(FAILURE_PROBABILITY / (2 * requests)) / math.log(1.0 - success))
    patience = sum(retry_delay_s(attempt) for attempt in range(1, attempts + 1))
    queue = math.ceil(requests / WINDOW) * RETRY_MAX_S * 2
    return 2 * patience + 2 * queue + QUIET_STAGES * QUIET_MAX_S


MARGIN: Final = 2.0
UNSEEN: Final = 15  # unanswered requests that are assumed in addition, so that the first answers weigh little
SOON_SENDS: Final = 2


class RoundTrips:
    """Round trips of requests and answers, by parameter name; `quiet_s` is the quiet period that follows from them.

    A quiet period of MARGIN times the longest round trip so far, longer the fewer requests were answered, from QUIET_S
    to QUIET_MAX_S; QUIET_MAX_S until an answer came soon. This is an estimate, no bound.
    """

    def __init__(self) -> None:
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
            return QUIET_MAX_S
        seldom = (len(self._first_s) + UNSEEN) / len(self._answered)
        return min(max(MARGIN * self._longest_s * seldom, QUIET_S), QUIET_MAX_S)

    def on_sent(self, name: str, time_s: float) -> None:
        """A write or read request of that name was sent."""
        self._first_s.setdefault(name, time_s)
        self._sends[name] = self._sends.get(name, 0) + 1

    def on_quiet(self, name: str) -> None:
        """No request for `name` is outstanding; start counting anew, unless an answer came soon."""
        if name not in self._answered:
            self._first_s.pop(name, None)
            self._sends.pop(name, None)

    def on_heard(self, name: str, time_s: float) -> None:
        """A PARAM_VALUE of that name arrived."""
        if name in self._answered or not 1 <= self._sends.get(name, 0) <= SOON_SENDS:
            return
        self._answered.add(name)
        self._longest_s = max(self._longest_s, time_s - self._first_s[name])
