"""Deadline arithmetic of requests over a link that loses some: pure functions of times and counts."""

import math
from dataclasses import dataclass
from typing import Final

STAGES: Final = 4  # quiet periods of an upload that is written, refused once, committed and switched to


@dataclass(frozen=True, slots=True)
class Timing:
    """How patient a transfer is.

    `window` requests fly at once; a lost one is repeated after `retry_s`, growing by half to `retry_max_s`.
    Between the last write and its read-back passes more than the longest round trip, so that no late echo of the write
    can pass for the read-back's answer: `quiet_s` at least, and `quiet_max_s` where answers are not known to come
    sooner (`RoundTrips`). All ends `deadline_s` after the start.
    """

    window: int = 8
    retry_s: float = 0.5
    retry_max_s: float = 1.0
    quiet_s: float = 1.0
    quiet_max_s: float = 10.0
    deadline_s: float = 60.0

    def __post_init__(self) -> None:
        if self.window < 1 or min(self.retry_s, self.quiet_s, self.deadline_s) <= 0:
            raise ValueError(f"a transfer needs a window and times above zero, not {self}")
        if self.retry_max_s < self.retry_s:
            raise ValueError(f"retry_max_s {self.retry_max_s} is below retry_s {self.retry_s}")
        if self.quiet_max_s < self.quiet_s:
            raise ValueError(f"quiet_max_s {self.quiet_max_s} is below quiet_s {self.quiet_s}")


def retry_delay_s(attempt: int, timing: Timing) -> float:
    """How long to wait for the answer to attempt 1, 2, 3 ... before the next."""
    return min(timing.retry_s * 1.5 ** min(attempt - 1, 16), timing.retry_max_s)


def attempts_needed(loss: float, requests: int, failure: float) -> int:
    """Attempts after which `requests` exchanges have all succeeded but for probability `failure`.

    An exchange succeeds with (1 - loss)^2: the request and its answer must both arrive.
    """
    success = (1.0 - loss) ** 2
    if success >= 1.0:
        return 1
    return max(1, math.ceil(math.log(failure / max(requests, 1)) / math.log(1.0 - success)))


def deadline_s(requests: int, timing: Timing, loss: float = 0.3, failure: float = 1e-4) -> float:
    """Time in which `requests` writes and their read-backs succeed on such a link but for `failure`, in as many stages
    as an upload has, each with its quiet period.
    """
    attempts = attempts_needed(loss, 2 * requests, failure)
    patience = sum(retry_delay_s(attempt, timing) for attempt in range(1, attempts + 1))
    queue = math.ceil(requests / timing.window) * timing.retry_max_s * 2
    return 2 * patience + 2 * queue + STAGES * timing.quiet_max_s


def is_past(now_s: float, start_s: float, allowed_s: float) -> bool:
    """Whether the deadline has come."""
    return now_s - start_s >= allowed_s
