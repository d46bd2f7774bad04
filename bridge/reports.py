"""Progress reports of a verb, one JSON object a line, for the program that started it; typed on both sides."""

import json
from collections.abc import Mapping
from dataclasses import astuple, dataclass, field, replace
from typing import Any

from bridge.errors import ConfigError
from bridge.schema import build

VARIABLE, FORM = "SEATRIAL_PROGRESS", "json"

PAGE = "page"
"""`Report.of` while a verb writes its page: its result exists by then."""

WRITING = "writing"
"""`Report.of` while parameters are written; before that the vehicle is looked for and read."""

UNKEPT = "unkept"
"""`Report.of` for a result that could not be written to its file; `words` say why, `result` holds it."""

APPLIED = "applied"
"""`Written.outcome` of a parameter that was read back equal."""

FLIGHT = "flight"
"""`Report.of` of a flight: `words` say the vehicle's activity, `values` are the widths with those asked for."""

SAID = "said"
"""`Report.of` for a sentence to the crew, in `words`; `share` means nothing."""

ERROR = "error"
"""`Report.of` for an error that ends the verb, or for a file that it could not write; `words` is its sentence, `stage`
the name of its class."""


@dataclass(frozen=True)
class Written:
    """A parameter that was just written: the name of its `Outcome` in small letters, and its sentence."""

    name: str
    outcome: str
    words: str

    @property
    def equal(self) -> bool:
        return self.outcome == APPLIED


@dataclass(frozen=True)
class Report:
    """Progress of a verb, as a line for the program that started it.

    of: the part of the work. share: how much of that part is done, 0 to 1. words: the present activity.
    stage: code of the stage of an upload, or name of an error. values: parameters as far as they are fitted, by name;
    answered: these are the final ones. written: the parameter that was just written. result: plain data, with UNKEPT.
    """

    of: str
    share: float
    words: str
    stage: str = ""
    values: dict[str, tuple[float, float]] = field(default_factory=dict)
    answered: bool = False
    written: Written | None = None
    result: Any = None


def asked(environment: Mapping[str, str]) -> bool:
    """Return whether the program that started this process reads its reports with `read`."""
    return environment.get(VARIABLE) == FORM


def line(report: Report) -> str:
    """Return a report as one line of JSON; `read` is its inverse."""
    data = {key: value for key, value in vars(report).items() if value or key in ("of", "share", "words")}
    if report.values or report.answered:
        data |= {"values": report.values, "answered": report.answered}
    if report.written is not None:
        data["written"] = astuple(report.written)
    return json.dumps(data, allow_nan=False) + "\n"


def read(text: str) -> Report | None:
    """Return the report of a line; None for any other line, such as a note or an error."""
    try:
        data = json.loads(text)
        written, result = data.pop("written", None), data.pop("result", None)
        report = build(Report, data, "report")
        return replace(
            report, written=None if written is None else Written(*map(str, written)), result=result
        )
    except (ValueError, TypeError, AttributeError, ConfigError):
        return None
