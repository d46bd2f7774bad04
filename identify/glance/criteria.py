"""What a dive must show before its feed-forward is raised, and what it comes to: go or no-go."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from bridge.vehicle.feedforward import Mode

WORDS: Final = {Mode.OFF: "off", Mode.SHADOW: "shadow", Mode.ALONE: "only", Mode.BOTH: "both"}
MARKS: Final = {True: "ok", False: "no", None: "unknown"}
ANEW: Final = "identify from this dive, upload, and dive in shadow again"


@dataclass(frozen=True)
class Criterion:
    """What was looked at, such as `surge mass`; whether it is as it must be, None where the dive does not show it; the
    figure with its limit, in words; `mend`: what to do where it is not."""

    what: str
    passed: bool | None
    words: str
    mend: str = ""


@dataclass(frozen=True)
class Raising:
    """The criteria, and the modes: that in which the dive was flown, and that to which they let it be raised."""

    flown: Mode
    to: Mode
    criteria: tuple[Criterion, ...]

    @property
    def go(self) -> bool:
        return all(one.passed is not False for one in self.criteria)

    @property
    def sentence(self) -> str:
        """The verdict."""
        if not self.go:
            failed = [one for one in self.criteria if one.passed is False]
            mends = dict.fromkeys(one.mend for one in failed)
            back = "lower the feed-forward to shadow" if self.flown.applies_feedforward else "don't raise it"
            return f"NO-GO, {back}: {_listed(failed)}. {_capital('; '.join(mends))}."
        flown, to = WORDS[self.flown], WORDS[self.to]
        unknown = [one for one in self.criteria if one.passed is None]
        rest = f" Not known from this dive: {_listed(unknown)}." if unknown else ""
        if self.flown is self.to:
            return f"GO: the feed-forward may stay at {flown}.{rest}"
        return f"GO: the feed-forward may be raised from {flown} to {to} (seatrial ff {to}).{rest}"

    def to_json(self) -> dict[str, Any]:
        return {
            "go": self.go,
            "from": WORDS[self.flown],
            "to": WORDS[self.to],
            "sentence": self.sentence,
            "criteria": [
                {"what": one.what, "passed": one.passed, "words": one.words} for one in self.criteria
            ],
        }


def _listed(criteria: Sequence[Criterion]) -> str:
    return ", ".join(one.what for one in criteria)


def _capital(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}"
