"""Criteria of a dive in a single FF_MODE before its feed-forward is raised, and the verdict: go or no-go."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from bridge.vehicle.mode import Mode
from identify.dive import Dive
from identify.words import capital

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
        flown, to = self.flown.word, self.to.word
        unknown = [criterion for criterion in self.criteria if criterion.passed is None]
        remark = f" Not known from this dive: {_listed(unknown)}." if unknown else ""
        if self.flown is self.to:
            return f"GO: the feed-forward may stay at {flown}.{remark}"
        return f"GO: the feed-forward may be raised from {flown} to {to} (seatrial ff {to}).{remark}"

    def to_json(self) -> dict[str, Any]:
        return {
            "go": self.go,
            "from": self.flown.word,
            "to": self.to.word,
            "sentence": self.sentence,
            "criteria": [
                {"what": criterion.what, "passed": criterion.passed, "words": criterion.words}
                for criterion in self.criteria
            ],
        }


def _listed(criteria: Sequence[Criterion]) -> str:
    return ", ".join(criterion.what for criterion in criteria)


MOVES: Final = 1e-3
"""Speed of a reference, m/s or rad/s, above which the reference moves."""
AROUND_S: Final = 2.0
OUT_OF_MODE: Final = "find out why it was taken back, and dive the mission again in one mode"


@dataclass(frozen=True)
class OneMode:
    """A mode (None if the dive reports no known mode) and the part of the dive flown in it.

    `changed` judges the changes of mode; None if there were none.
    """

    mode: Mode | None
    dive: Dive
    changed: Criterion | None = None


def in_one_mode(dive: Dive) -> OneMode:
    """Select the part between two changes of FF_MODE in which the reference moved longest, otherwise the longest part.

    If the crew or the vehicle lowered the mode out of feed-forward while the reference moved, that fails the
    criterion.
    """
    if dive.ff_mode is None or not len(dive.ff_mode):
        return OneMode(None, dive)
    time_s, value = dive.ff_mode.time_s, dive.ff_mode.value[:, 0]
    starts = np.concatenate([[0], np.flatnonzero(np.diff(value)) + 1])
    modes = [int(mode_number) for mode_number in value[starts]]
    begins_s = np.concatenate([[-np.inf], time_s[starts[1:]]])
    ends_s = np.concatenate([time_s[starts[1:]], [np.inf]])
    parts = [dive.between(float(begin), float(end)) for begin, end in zip(begins_s, ends_s, strict=True)]
    lasts_s = np.minimum(ends_s, time_s[-1]) - np.maximum(begins_s, time_s[0])
    chosen = max(range(len(parts)), key=lambda n: (_moves_for(parts[n]), lasts_s[n]))
    mode = Mode(modes[chosen]) if modes[chosen] in set(Mode) else None
    if len(parts) == 1:
        return OneMode(mode, parts[0])
    flown = ", ".join(
        f"{_word(mode_number)} {seconds:.0f} s" for mode_number, seconds in zip(modes, lasts_s, strict=True)
    )
    words = f"changed in the dive ({flown}); judged is the part in {_word(modes[chosen])} of {lasts_s[chosen]:.0f} s"
    taken_back = any(
        _applies(before)
        and not _applies(after)
        and _moves_for(dive.between(at_s - AROUND_S, at_s + AROUND_S))
        for before, after, at_s in zip(modes, modes[1:], begins_s[1:], strict=False)
    )
    if taken_back:
        words = f"taken back while the reference moved: {words}"
    return OneMode(mode, parts[chosen], Criterion("mode", not taken_back, words, OUT_OF_MODE))


def _moves_for(dive: Dive) -> int:
    """Number of readings in which the reference moves."""
    if dive.nu_ref is None:
        return 0
    return int(np.count_nonzero(np.any(np.abs(np.nan_to_num(dive.nu_ref.value[:, :6])) > MOVES, axis=1)))


def _applies(mode: int) -> bool:
    return mode in set(Mode) and Mode(mode).applies_feedforward


def _word(mode: int) -> str:
    return Mode(mode).word if mode in set(Mode) else f"mode {mode}"
