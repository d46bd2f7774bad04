"""What is typed before anything is written: how many lines, and a word for each thing that makes it harder."""

import re
from typing import Final

ARMED: Final = "ARMED"
DOUBTED: Final = "DOUBTED"

_WORD = re.compile(r"[A-Z]+|\d+")


def needed(lines: int, *, armed: bool, doubted: bool) -> str:
    """`7`, or `ARMED 7`; with DOUBTED for an identification that did not converge."""
    return " ".join((*((ARMED,) if armed else ()), *((DOUBTED,) if doubted else ()), str(lines)))


def agrees(typed: str, asked: str) -> bool:
    """Whether it was typed, in any order and in small letters too."""
    return sorted(_WORD.findall(typed.upper())) == sorted(asked.split()) and bool(typed.strip())
