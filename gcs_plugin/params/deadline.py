"""Deadlines and retry delays of requests over a lossy link: pure functions of times and counts."""

import math
from dataclasses import dataclass
from typing import Final

STAGES: Final = 4  # quiet periods of an upload that is written, refused once, committed and switched to


@dataclass(frozen=True, slots=True)
class Timing:
    """Timing of a transfer.

    At most `window` requests are open at once; a request without an answer is repeated after `retry_s`, a delay that
    grows by half each time up to `retry_max_s`. The quiet period between the last write and its read-back is longer
    than the longest round trip, so that no late echo of the write can pass for the read-back's answer: at least
    `quiet_s`, and `quiet_max_s` if answers are not known to arrive sooner (`RoundTrips`). The transfer ends
    `deadline_s` after its start.
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
    """Delay between attempt number `attempt` (from 1) and the next, s."""
    return min(timing.retry_s * 1.5 ** min(attempt - 1, 16), timing.retry_max_s)


def attempts_needed(loss: float, requests: int, failure: float) -> int:
    """Number of attempts after which all of `requests` exchanges have succeeded, except with probability `failure`.

    An attempt succeeds with probability (1 - loss)^2: the request and its answer must both arrive.
    """
    success = (1.0 - loss) ** 2
    if success >= 1.0:
        return 1
    return max(1, math.ceil(math.log(failure / max(requests, 1)) / math.log(1.0 - success)))


def deadline_s(requests: int, timing: Timing, loss: float = 0.3, failure: float = 1e-4) -> float:
    """Time in which `requests` writes and their read-backs all succeed except with probability `failure`, s.

    `loss` is the link's loss in each direction. Includes a quiet period of `quiet_max_s` for each of the STAGES of an
    upload.
    """
    attempts = attempts_needed(loss, 2 * requests, failure)
    patience = sum(retry_delay_s(attempt, timing) for attempt in range(1, attempts + 1))
    queue = math.ceil(requests / timing.window) * timing.retry_max_s * 2
    return 2 * patience + 2 * queue + STAGES * timing.quiet_max_s


def is_past(now_s: float, start_s: float, allowed_s: float) -> bool:
    """Whether `allowed_s` have passed since `start_s`."""
    return now_s - start_s >= allowed_s
