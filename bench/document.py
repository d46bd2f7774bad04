"""docs/benchmarks.md as sections between marks, so that one can be measured anew and the others stay."""

import re

HEAD = (
    "# Benchmarks\n\nWritten by `make bench`; every figure here comes from it. A section that is not here has not\n"
    "been run since the estimators last changed.\n\n"
)
_BLOCK = re.compile(r"<!-- section: (?P<name>[^>]+) -->\n(?P<text>.*?)(?=<!-- section: |\Z)", re.DOTALL)


def read(text: str) -> dict[str, str]:
    """The sections of the document by name."""
    return {block["name"]: block["text"].strip("\n") for block in _BLOCK.finditer(text)}


def written(sections: dict[str, str], order: tuple[str, ...]) -> str:
    """The document: sections in the given order, those that it does not name left out."""
    blocks = [
        f"<!-- section: {name} -->\n{sections[name].strip(chr(10))}\n" for name in order if name in sections
    ]
    return HEAD + "\n".join(blocks)
