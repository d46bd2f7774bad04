"""The text of a proposed column map: YAML, with a comment where a choice should be checked."""

import textwrap

import yaml

from identify.ingest.mapping.candidates import Choice, Confidence
from identify.ingest.mapping.column_map import BODY, Columns
from identify.ingest.mapping.proposal import Proposal

WIDTH = 110
DIGITS = 8


def map_text(proposal: Proposal, name: str) -> str:
    """The YAML of a proposal for the file of that name; comments hold the reasons of guesses, and mends."""
    columns = proposal.columns
    lines = [
        *_comment(f"Column map of {name}, proposed from its names and ranges: check it."),
        *_comment(_AXES),
    ]
    lines += _comment(proposal.time_reason)
    lines.append(_entry("time", {"column": columns.time.column, "unit": columns.time.unit}))
    if columns.runs is not None:
        lines.append(_entry("runs", {"column": columns.runs.column}))
    for choice in proposal.choices:
        lines += [line for reason in uncertain(choice) for line in _comment(reason)]
        lines.append(_entry(choice.signal, _plain(choice.columns)))
    if columns.velocity_is_filtered:
        lines += _comment(FILTERED)
        lines.append("velocity_is_filtered: true")
    return "\n".join(lines) + "\n"


FILTERED = "By its name, the velocity comes from a filter; set `velocity_is_filtered` to false if a sensor measured it."
_AXES = (
    "A dive's body axes are x forward, y to starboard, z down; value = (cell + offset) * scale, in `unit`."
)


def uncertain(choice: Choice) -> tuple[str, ...]:
    """Points of a choice for the user to check, in sentences: the reasons of a guess, and its mends."""
    return (
        *(filter(None, choice.reasons) if choice.confidence is Confidence.GUESSED else ()),
        *(f"{mend.problem}; mended here." for mend in choice.mends),
    )


def _plain(columns: Columns) -> dict[str, object]:
    plain: dict[str, object] = {"columns": list(columns.columns), "unit": columns.unit}
    for key, values in (("offset", columns.offset), ("scale", columns.scale)):
        if values:
            plain[key] = [_short(value) for value in values]
    if columns.frame != BODY:
        plain["frame"] = columns.frame
    return plain


def _short(value: float) -> float | int:
    """A number to so many digits that it reads well; whole ones without a point."""
    rounded = float(f"{value:.{DIGITS}g}")
    return int(rounded) if rounded.is_integer() else rounded


def _entry(key: str, value: dict[str, object]) -> str:
    dumped = yaml.safe_dump(value, default_flow_style=True, sort_keys=False, width=10**6, allow_unicode=True)
    return f"{key}: {dumped.strip()}"


def _comment(sentence: str) -> list[str]:
    return textwrap.wrap(sentence, WIDTH, initial_indent="# ", subsequent_indent="# ", break_long_words=False)
