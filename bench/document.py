"""docs/benchmarks.md as sections between marks, so that one can be measured anew and the others stay."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

HEAD = (
    "# Benchmarks\n\nWritten by `make bench`; every figure here comes from it. Each section is marked with a stamp of\n"
    "the code that it was measured with. Where that code had changed when this page was last written, the section\n"
    "begins by saying so.\n\n"
)
OLDER = "*The code behind this section has changed since it was measured.*\n\n"
_BLOCK = re.compile(
    r"<!-- section: (?P<name>[^;>]+?)(; code: (?P<code>\w+))? -->\n(?P<text>.*?)(?=<!-- section: |\Z)",
    re.DOTALL,
)


@dataclass(frozen=True)
class Section:
    """What stands under a mark; `code` is the stamp of what it was measured with, `older` whether that has changed."""

    text: str
    code: str
    older: bool = False


def read(text: str) -> dict[str, Section]:
    """The sections of the document by name."""
    found = {}
    for block in _BLOCK.finditer(text):
        older = block["text"].startswith(OLDER)
        body = block["text"].removeprefix(OLDER).strip("\n")
        found[block["name"]] = Section(body, block["code"] or "", older)
    return found


def compared(sections: Mapping[str, Section], codes: Mapping[str, str]) -> dict[str, Section]:
    """The sections that `codes` names, each older or not by the stamp of its code today."""
    return {
        name: replace(one, older=one.code != codes[name]) for name, one in sections.items() if name in codes
    }


def written(sections: Mapping[str, Section], order: tuple[str, ...]) -> str:
    """The document: sections in the given order, those that it does not name left out."""
    blocks = [_block(name, sections[name]) for name in order if name in sections]
    return HEAD + "\n".join(blocks)


def _block(name: str, one: Section) -> str:
    code = f"; code: {one.code}" if one.code else ""
    label = OLDER if one.older else ""
    return f"<!-- section: {name}{code} -->\n{label}{one.text.strip(chr(10))}\n"
