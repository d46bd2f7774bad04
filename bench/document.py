"""docs/benchmarks.md as sections between marks, so that single sections can be measured again and the others stay."""

import re
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from bench.remembered import Remembered
from bench.words import blocks, in_a_word, paragraph

GOAL_MIN = 90.0


@contextmanager
def timed(cache: Path, section: str, code: str) -> Iterator[None]:
    """Add the wall time of the `with` block to that of a section of this code, even if it is interrupted."""
    began_s = time.perf_counter()
    try:
        yield
    finally:
        kept = Remembered(cache / "wall.jsonl")
        before_s = _kept_s(kept, section, code)
        kept.put(f"{section} {code}", {"seconds": before_s + time.perf_counter() - began_s})


def wall_s(cache: Path, section: str, code: str) -> float:
    """Wall time of a section of this code in all runs so far, in whole seconds as on the page; 0 if none was kept."""
    return float(round(_kept_s(Remembered(cache / "wall.jsonl"), section, code)))


def _kept_s(kept: Remembered, section: str, code: str) -> float:
    key = f"{section} {code}"
    return float(kept.get(key, dict)["seconds"]) if key in kept else 0.0


def wall_words(seconds: Mapping[str, float]) -> str:
    """The paragraph at the top of the page: the time of `make bench` from its sections' times."""
    minutes = sum(seconds.values()) / 60
    each = ", ".join(f"{name} {wall_s / 60:.1f}" for name, wall_s in seconds.items())
    return paragraph(
        f"`make bench` took {minutes:.0f} min of wall time, the runs of its sections added up ({each}); what",
        "they took over from an earlier run is not in it.",
        f"Goal: within {GOAL_MIN:g} min: {in_a_word(minutes <= GOAL_MIN)}.",
    )


HEAD = (
    "# Benchmarks\n\n"
    "Written by `python -m bench`; every figure here comes from it. Each section is marked with a stamp\n"
    "of the code that it was measured with. Where that code had changed when this page was last written, the\n"
    "section begins by saying so.\n\n"
)
OLDER = "*The code behind this section has changed since it was measured.*\n\n"
_BLOCK = re.compile(
    r"<!-- section: (?P<name>[^;>]+); code: (?P<code>\w+); seconds: (?P<wall>\d+)(?P<asked>; asked)? -->\n"
    r"(?P<text>.*?)(?=<!-- section: |\Z)",
    re.DOTALL,
)


@dataclass(frozen=True)
class Section:
    """The section under a mark. `code`: stamp of the code that it was measured with; `older`: that code has changed.

    wall_s: time of the measurement. asked: the section is not part of `make bench`.
    """

    text: str
    code: str
    older: bool = False
    wall_s: float = 0.0
    asked: bool = False


def read(text: str) -> dict[str, Section]:
    sections = {}
    for block in _BLOCK.finditer(text):
        older = block["text"].startswith(OLDER)
        body = block["text"].removeprefix(OLDER).strip("\n")
        sections[block["name"]] = Section(
            body, block["code"], older, float(block["wall"]), bool(block["asked"])
        )
    return sections


def compared(sections: Mapping[str, Section], codes: Mapping[str, str]) -> dict[str, Section]:
    """The sections that `codes` names, each marked older if its stamp differs from that of today's code."""
    return {
        name: replace(section, older=section.code != codes[name])
        for name, section in sections.items()
        if name in codes
    }


def written(sections: Mapping[str, Section], order: tuple[str, ...]) -> str:
    """The document: sections in the given order; those that `order` does not name are left out."""
    shown = {name: sections[name] for name in order if name in sections}
    took = wall_words({name: section.wall_s for name, section in shown.items() if not section.asked})
    asked = [name for name, section in shown.items() if section.asked]
    beyond = paragraph(f"No part of it, and run by name alone: {', '.join(asked)}.") if asked else ""
    top = "\n".join(filter(None, (took, beyond)))
    return HEAD + blocks(top, *(_block(name, section) for name, section in shown.items())) + "\n"


def _block(name: str, section: Section) -> str:
    mark = f"section: {name}; code: {section.code}; seconds: {section.wall_s:.0f}{'; asked' if section.asked else ''}"
    label = OLDER if section.older else ""
    return f"<!-- {mark} -->\n{label}{section.text}"
