"""The doctor's results: a name, a level and a sentence each."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from typing import Any


class Level(Enum):
    """How bad a finding is; the value is the word that a user reads."""

    OK = "ok"
    WARN = "warning"
    FAIL = "failed"


@dataclass(frozen=True, slots=True)
class Finding:
    """A single result; `confidence` runs from 0 to 1, None if the check weighs no evidence."""

    name: str
    level: Level
    sentence: str
    confidence: float | None = None

    def to_json(self) -> dict[str, Any]:
        data: dict[str, Any] = {"name": self.name, "level": self.level.value, "sentence": self.sentence}
        if self.confidence is not None:
            data["confidence"] = round(self.confidence, 3)
        return data


def ok(name: str, sentence: str, confidence: float | None = None) -> Finding:
    return Finding(name, Level.OK, sentence, confidence)


def warn(name: str, sentence: str, confidence: float | None = None) -> Finding:
    return Finding(name, Level.WARN, sentence, confidence)


def fail(name: str, sentence: str, confidence: float | None = None) -> Finding:
    return Finding(name, Level.FAIL, sentence, confidence)


def worst(findings: Iterable[Finding]) -> Level:
    """The worst level of all findings; OK if there are none."""
    levels = {finding.level for finding in findings}
    return next((level for level in (Level.FAIL, Level.WARN) if level in levels), Level.OK)
