"""Codes at the start of the texts (STATUSTEXT) that a program reads: "F5:13247 FF set 13247 active".

The words behind a code are for people, and may be worded anew at any time; the ground decides by the code alone.
"""

from dataclasses import dataclass
from enum import Enum


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


def decoded(text: str) -> CrewText:
    """Take a text apart; any text without a known code is words alone."""
    token, blank, words = text.partition(" ")
    code, colon, digits = token.partition(":")
    is_number = digits.isascii() and digits.isdecimal() and len(digits) <= _MOST_DIGITS
    if code not in _TOPICS or not blank or bool(colon) != is_number:
        return CrewText(text)
    return CrewText(words, _TOPICS[code], int(digits) if is_number else None)
