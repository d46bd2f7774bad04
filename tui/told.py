"""Progress for a program to read: a line of JSON each time that a verb reports its progress."""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

VARIABLE, FORM = "SEATRIAL_PROGRESS", "json"

PAGE = "page"
"""Name of the progress while a verb writes its page: the result exists by then."""

WRITING = "writing"
"""Name of the progress while parameters are written; before that, the vehicle is looked for and read."""

ANSWERED = "answered"
"""Begins the words of a method that has finished, followed by its values."""

UNKEPT = "unkept"
"""Name of the report that a verb's result can't be written to its file: the reason, and the result itself."""

_LINE = re.compile(r"(\w+): (.+)")
_VALUE = re.compile(r"(\w+) (\S+) ± (\S+?)(?:,|$)")


@dataclass(frozen=True)
class Told:
    """Progress of a job: its name, the share done (0 to 1), and its present action; with UNKEPT the result as plain
    data, otherwise None."""

    of: str
    share: float
    words: str
    result: Any = None

    @property
    def values(self) -> dict[str, tuple[float, float]]:
        """The parameters in the words so far, with half of their 95 % intervals; SI units."""
        return {name: (float(value), float(half)) for name, value, half in _VALUE.findall(self.words)}

    @property
    def is_answer(self) -> bool:
        """Whether a method is done, so that the values are its answer."""
        return self.share >= 1.0 and f"{ANSWERED}: " in self.words

    @property
    def line(self) -> tuple[str, str] | None:
        """The parameter that was just written, and its outcome; None for other words."""
        match = _LINE.fullmatch(self.words)
        return (match.group(1), match.group(2)) if match else None


def line_words(name: str, became: str) -> str:
    """Make the words that `Told.line` reads."""
    return f"{name}: {became}"


def asked(environment: Mapping[str, str]) -> bool:
    """Whether the program that started this process reads its progress by `read`."""
    return environment.get(VARIABLE) == FORM


def line(told: Told) -> str:
    unkept = {} if told.result is None else {"result": told.result}
    return (
        json.dumps({"of": told.of, "share": told.share, "words": told.words} | unkept, allow_nan=False) + "\n"
    )


def read(text: str) -> Told | None:
    """Decode a line of progress; None for any other line, such as a note or an error."""
    try:
        data = json.loads(text)
        return Told(str(data["of"]), float(data["share"]), str(data["words"]), data.get("result"))
    except (ValueError, TypeError, KeyError):
        return None
