"""docs/benchmarks.md as sections between marks, so that single sections can be measured again and the others stay."""

import re
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from bench.remembered import Remembered
from bench.words import in_a_word, paragraph

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


def wall_lines(whole: Mapping[str, float | None]) -> list[str]:
    """The paragraph at the top of the page: the time of `make bench` from its sections' times, None if not kept."""
    known = {name: seconds for name, seconds in whole.items() if seconds is not None}
    lacking = [name for name in whole if name not in known]
    if not known:
        return paragraph("How long `make bench` took was not kept when these sections were measured.")
    minutes = sum(known.values()) / 60
    each = ", ".join(f"{name} {seconds / 60:.1f}" for name, seconds in known.items())
    if not lacking:
        verdict = f"Goal: within {GOAL_MIN:g} min: {in_a_word(minutes <= GOAL_MIN)}."
    else:
        verdict = (
            f"It was not kept of {', '.join(lacking)}, so that the goal of {GOAL_MIN:g} min can't be judged."
        )
    return paragraph(
        f"`make bench` took {minutes:.0f} min of wall time, the runs of its sections added up ({each}); what",
        f"they took over from an earlier run is not in it. {verdict}",
    )


HEAD = (
    "# Benchmarks\n\n"
    "Written by `python -m bench`; every figure here comes from it. Each section is marked with a stamp\n"
    "of the code that it was measured with. Where that code had changed when this page was last written, the\n"
    "section begins by saying so.\n\n"
)
OLDER = "*The code behind this section has changed since it was measured.*\n\n"
_BLOCK = re.compile(
    r"<!-- section: (?P<name>[^;>]+?)(; code: (?P<code>\w+))?(; seconds: (?P<wall>\d+))?(?P<asked>; asked)? -->\n"
    r"(?P<text>.*?)(?=<!-- section: |\Z)",
    re.DOTALL,
)


@dataclass(frozen=True)
class Section:
    """The section under a mark. `code`: stamp of the code that it was measured with; `older`: that code has changed.

    wall_s: time of the measurement, None if it was not kept. asked: the section is not part of `make bench`.
    """

    text: str
    code: str
    older: bool = False
    wall_s: float | None = None
    asked: bool = False


def read(text: str) -> dict[str, Section]:
    """The sections of the document by name."""
    sections = {}
    for block in _BLOCK.finditer(text):
        older = block["text"].startswith(OLDER)
        body = block["text"].removeprefix(OLDER).strip("\n")
        wall_s = float(block["wall"]) if block["wall"] else None
        sections[block["name"]] = Section(body, block["code"] or "", older, wall_s, bool(block["asked"]))
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
    took = wall_lines({name: section.wall_s for name, section in shown.items() if not section.asked})
    asked = [name for name, section in shown.items() if section.asked]
    beyond = paragraph(f"No part of it, and run by name alone: {', '.join(asked)}.") if asked else []
    blocks = [_block(name, section) for name, section in shown.items()]
    return HEAD + "\n".join([*took, *beyond, "", *blocks])


def _block(name: str, section: Section) -> str:
    code = f"; code: {section.code}" if section.code else ""
    seconds = "" if section.wall_s is None else f"; seconds: {section.wall_s:.0f}"
    asked = "; asked" if section.asked else ""
    label = OLDER if section.older else ""
    return f"<!-- section: {name}{code}{seconds}{asked} -->\n{label}{section.text.strip(chr(10))}\n"
