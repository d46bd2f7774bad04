"""Confirmation typed before parameters are written: the number of lines, and a word for each aggravating condition."""

import re
from typing import Final

ARMED: Final = "ARMED"
DOUBTED: Final = "DOUBTED"

_WORD = re.compile(r"[A-Z]+|\d+")


def needed(lines: int, *, armed: bool, doubted: bool) -> str:
    """Return the confirmation text, `7` or `ARMED 7`; with DOUBTED for an identification that did not converge."""
    return " ".join((*((ARMED,) if armed else ()), *((DOUBTED,) if doubted else ()), str(lines)))


def agrees(typed: str, asked: str) -> bool:
    """Whether the text confirms, in any order and in either case."""
    return sorted(_WORD.findall(typed.upper())) == sorted(asked.split()) and bool(typed.strip())
