"""Progress as a program reads it: a line of JSON each time that a verb tells how far it is."""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

VARIABLE, FORM = "SEATRIAL_PROGRESS", "json"

PAGE = "page"
"""What is told of while the page of a verb is written: its result is there by then."""

WRITING = "writing"
"""What is told of while parameters are written; before that the vehicle is looked for and read."""

ANSWERED = "answered"
"""Begins what a method tells once it is done, with its values."""

UNKEPT = "unkept"
"""What is told of where the result of a verb can't be written to its place: why not, and the result itself."""

_LINE = re.compile(r"(\w+): (.+)")
_VALUE = re.compile(r"(\w+) (\S+) ± (\S+?)(?:,|$)")


@dataclass(frozen=True)
class Told:
    """How far something is: what it is, the share of it that is done (0 to 1), and what it does now; with UNKEPT the
    result as plain data, else None."""

    of: str
    share: float
    words: str
    result: Any = None

    @property
    def values(self) -> dict[str, tuple[float, float]]:
        """The parameters that the words tell so far, with the half of their 95 % intervals; SI units."""
        return {name: (float(value), float(half)) for name, value, half in _VALUE.findall(self.words)}

    @property
    def is_answer(self) -> bool:
        """Whether a method is done, and the values are those that it answers."""
        return self.share >= 1.0 and f"{ANSWERED}: " in self.words

    @property
    def line(self) -> tuple[str, str] | None:
        """The parameter that was just written, and what became of it; None for words that tell something else."""
        match = _LINE.fullmatch(self.words)
        return (match.group(1), match.group(2)) if match else None


def line_words(name: str, became: str) -> str:
    """Words that `Told.line` reads."""
    return f"{name}: {became}"


def asked(environment: Mapping[str, str]) -> bool:
    """Whether whoever started this process reads its progress by `read`."""
    return environment.get(VARIABLE) == FORM


def line(told: Told) -> str:
    unkept = {} if told.result is None else {"result": told.result}
    return (
        json.dumps({"of": told.of, "share": told.share, "words": told.words} | unkept, allow_nan=False) + "\n"
    )


def read(text: str) -> Told | None:
    """What a line tells; None for one that is no progress, such as a note or an error."""
    try:
        data = json.loads(text)
        return Told(str(data["of"]), float(data["share"]), str(data["words"]), data.get("result"))
    except (ValueError, TypeError, KeyError):
        return None
