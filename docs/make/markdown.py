"""Markdown in the few forms that the reference has."""

from collections.abc import Iterable, Sequence

MADE = "Made from the code by `make docs`."


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table; a bar within a cell is kept from ending it."""
    lines = (head, ["---"] * len(head), *rows)
    return "".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |\n" for line in lines)


def code(text: str) -> str:
    return f"`{text}`" if text else ""


def number(value: float) -> str:
    """A bound, short; infinities as none."""
    return "" if abs(value) == float("inf") else f"{value:.4g}"
