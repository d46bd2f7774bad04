"""docs/benchmarks.md as sections between marks, so that one can be measured anew and the others stay."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

from bench import wall

HEAD = (
    "# Benchmarks\n\nWritten by `make bench`; every figure here comes from it. Each section is marked with a stamp of\n"
    "the code that it was measured with. Where that code had changed when this page was last written, the section\n"
    "begins by saying so.\n\n"
)
OLDER = "*The code behind this section has changed since it was measured.*\n\n"
_BLOCK = re.compile(
    r"<!-- section: (?P<name>[^;>]+?)(; code: (?P<code>\w+))?(; seconds: (?P<wall>\d+))?(?P<asked>; asked)? -->\n"
    r"(?P<text>.*?)(?=<!-- section: |\Z)",
    re.DOTALL,
)


@dataclass(frozen=True)
class Section:
    """What stands under a mark; `code` is the stamp of what it was measured with, `older` whether that has changed.

    wall_s: what it took to measure, None where that was not kept. asked: it is no part of `make bench`.
    """

    text: str
    code: str
    older: bool = False
    wall_s: float | None = None
    asked: bool = False


def read(text: str) -> dict[str, Section]:
    """The sections of the document by name."""
    found = {}
    for block in _BLOCK.finditer(text):
        older = block["text"].startswith(OLDER)
        body = block["text"].removeprefix(OLDER).strip("\n")
        wall_s = float(block["wall"]) if block["wall"] else None
        found[block["name"]] = Section(body, block["code"] or "", older, wall_s, bool(block["asked"]))
    return found


def compared(sections: Mapping[str, Section], codes: Mapping[str, str]) -> dict[str, Section]:
    """The sections that `codes` names, each older or not by the stamp of its code today."""
    return {
        name: replace(one, older=one.code != codes[name]) for name, one in sections.items() if name in codes
    }


def written(sections: Mapping[str, Section], order: tuple[str, ...]) -> str:
    """The document: sections in the given order, those that it does not name left out."""
    shown = {name: sections[name] for name in order if name in sections}
    took = wall.lines({name: one.wall_s for name, one in shown.items() if not one.asked})
    blocks = [_block(name, one) for name, one in shown.items()]
    return HEAD + "\n".join([*took, "", *blocks])


def _block(name: str, one: Section) -> str:
    code = f"; code: {one.code}" if one.code else ""
    seconds = "" if one.wall_s is None else f"; seconds: {one.wall_s:.0f}"
    asked = "; asked" if one.asked else ""
    label = OLDER if one.older else ""
    return f"<!-- section: {name}{code}{seconds}{asked} -->\n{label}{one.text.strip(chr(10))}\n"
