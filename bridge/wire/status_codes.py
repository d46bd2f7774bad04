"""Texts to the crew (STATUSTEXT), and codes at the start of those that a program reads: "F5:13247 FF set 13247 active".

The words behind a code are for people, and may be worded anew at any time; the ground decides by the code alone.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect


class Topic(Enum):
    """What a coded text is about; the value is its code. Codes never change their meaning."""

    NO_SET = "F1"
    """A mode that acts is refused: no parameter set is active."""
    UNPROVEN = "F2"
    """A mode is refused while armed: the shadow is not good yet. SHADOW follows."""
    SHADOW = "F3"
    """What the shadow lacks."""
    STRANGER = "F4"
    """Orders from the system of that number are refused."""
    SET_ACTIVE = "F5"
    """The set of that number is active."""
    SET_FAULT = "F6"
    """What the set in force lacks, or holds that can't be used."""
    OBSTACLE = "F7"
    """Why nothing is added beside the autopilot whatever the mode, and the way out. Said again while it holds."""

    ONCE_ARMED = "F8"
    """The feed-forward acts once the vehicle is armed."""


@dataclass(frozen=True, slots=True)
class CrewText:
    """A text without its code; `topic` is None for a text without one."""

    words: str
    topic: Topic | None = None
    number: int | None = None


_TOPICS = {topic.value: topic for topic in Topic}
_MOST_DIGITS = 10


def coded(topic: Topic, words: str, number: int | None = None) -> str:
    """The text with its code, which `decoded` reads."""
    return f"{topic.value}{'' if number is None else f':{number}'} {words}"


def without_set_faults(texts: Iterable[str]) -> tuple[str, ...]:
    """The texts but for those about the set in force, which another set may mend."""
    return tuple(text for text in texts if decoded(text).topic is not Topic.SET_FAULT)


def decoded(text: str) -> CrewText:
    """Take a text apart; any text without a known code is words alone."""
    token, blank, words = text.partition(" ")
    code, colon, digits = token.partition(":")
    is_number = digits.isascii() and digits.isdecimal() and len(digits) <= _MOST_DIGITS
    if code not in _TOPICS or not blank or bool(colon) != is_number:
        return CrewText(text)
    return CrewText(words, _TOPICS[code], int(digits) if is_number else None)


def status_texts(text: str, severity: int, number: int) -> list[Any]:
    """Return a STATUSTEXT of any length in pieces of 50 bytes; `number` (1 to 65535) joins those of a long text.

    A receiver takes the first piece with a NUL for the last, so the last of several is never full.
    """
    data = text.encode("ascii", errors="replace")
    is_long = len(data) > 50
    pieces = [data[i : i + 50] for i in range(0, max(len(data) + is_long, 1), 50)]
    together = number if is_long else 0
    return [
        dialect.MAVLink_statustext_message(severity, piece, together, i) for i, piece in enumerate(pieces)
    ]
