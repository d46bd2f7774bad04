"""Modes of the feed-forward, and operators' name of each."""

from enum import IntEnum


class Mode(IntEnum):
    """FF_MODE: whether the feed-forward is applied, and whether the PID of its axes is."""

    OFF = 0
    SHADOW = 1
    ALONE = 2
    BOTH = 3

    @property
    def applies_feedforward(self) -> bool:
        return self in (Mode.ALONE, Mode.BOTH)

    @property
    def applies_pid(self) -> bool:
        """Whether the PID acts in surge, sway and yaw; the PID of heave, roll and pitch always does."""
        return self is not Mode.ALONE

    @property
    def word(self) -> str:
        return _WORDS[self]

    def raises(self, before: "Mode") -> bool:
        """Whether this mode relies more on the feed-forward than `before` did: it now acts, or acts without the PID."""
        return _LEFT_TO_IT[self] > _LEFT_TO_IT[before]


ACTING = tuple(mode for mode in Mode if mode.applies_feedforward)
"""The modes in which the feed-forward acts on the thrusters."""

_WORDS = {Mode.OFF: "off", Mode.SHADOW: "shadow", Mode.ALONE: "ff", Mode.BOTH: "both"}
_LEFT_TO_IT = {Mode.OFF: 0, Mode.SHADOW: 0, Mode.BOTH: 1, Mode.ALONE: 2}

BY_WORD = {mode.word: mode for mode in Mode}


def word_of(value: float) -> str:
    """Operators' name of an FF_MODE value; the number itself if it is no mode."""
    return Mode(int(value)).word if value in set(Mode) else f"{value:g}"
