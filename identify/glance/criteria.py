"""Criteria that a dive must meet before its feed-forward is raised, and the verdict: go or no-go."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from bridge.vehicle.feedforward import Mode
from identify.words import capital

WORDS: Final = {Mode.OFF: "off", Mode.SHADOW: "shadow", Mode.ALONE: "only", Mode.BOTH: "both"}
MARKS: Final = {True: "ok", False: "no", None: "unknown"}
ANEW: Final = "identify from this dive, upload, and dive in shadow again"


@dataclass(frozen=True)
class Criterion:
    """A check of a dive.

    what: the quantity checked, such as `surge mass`. passed: None if the dive does not show it. words: the figure
    with its limit. mend: what to do if the check fails.
    """

    what: str
    passed: bool | None
    words: str
    mend: str = ""


@dataclass(frozen=True)
class Raising:
    """The criteria, the mode in which the dive was flown, and the mode to which the criteria let it be raised."""

    flown: Mode
    to: Mode
    criteria: tuple[Criterion, ...]

    @property
    def go(self) -> bool:
        return all(criterion.passed is not False for criterion in self.criteria)

    @property
    def sentence(self) -> str:
        """The verdict."""
        if not self.go:
            failed = [criterion for criterion in self.criteria if criterion.passed is False]
            mends = dict.fromkeys(criterion.mend for criterion in failed)
            back = "lower the feed-forward to shadow" if self.flown.applies_feedforward else "don't raise it"
            return f"NO-GO, {back}: {_listed(failed)}. {capital('; '.join(mends))}."
        flown, to = WORDS[self.flown], WORDS[self.to]
        unknown = [criterion for criterion in self.criteria if criterion.passed is None]
        remark = f" Not known from this dive: {_listed(unknown)}." if unknown else ""
        if self.flown is self.to:
            return f"GO: the feed-forward may stay at {flown}.{remark}"
        return f"GO: the feed-forward may be raised from {flown} to {to} (seatrial ff {to}).{remark}"

    def to_json(self) -> dict[str, Any]:
        return {
            "go": self.go,
            "from": WORDS[self.flown],
            "to": WORDS[self.to],
            "sentence": self.sentence,
            "criteria": [
                {"what": criterion.what, "passed": criterion.passed, "words": criterion.words}
                for criterion in self.criteria
            ],
        }


def _listed(criteria: Sequence[Criterion]) -> str:
    return ", ".join(criterion.what for criterion in criteria)
