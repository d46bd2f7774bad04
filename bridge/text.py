"""Text for people: harmless on any screen, wrapped, said to the crew.

A vehicle, a file or a name may hold characters that steer a terminal.
"""

import math
import os
import shlex
import shutil
import sys
import textwrap
import unicodedata
from contextlib import suppress
from typing import Final

MARK: Final = "?"
"""Printed for a character that could steer the terminal."""


def printable(text: str, mark: str = "", keep: str = "") -> str:
    """Return `text` with `mark` for each character not in `keep` that could steer a terminal or hide in it.

    These are control characters (ESC, C1, line ends), characters that turn the direction of writing, and surrogates.
    """
    if text.isascii() and text.isprintable():
        return text
    return "".join(c if c in keep or _is_harmless(c) else mark for c in text)


def _is_harmless(character: str) -> bool:
    return character.isprintable() or unicodedata.category(character) == "Zs"


def typed(*words: object) -> str:
    """Words of a command as a shell takes them, such as a path: in quotes where it has spaces or signs."""
    return shlex.join(map(str, words))


def as_clause(sentence: str) -> str:
    """A sentence for use inside another: without its stop, and small at its beginning, unless that is a name."""
    clause = sentence.rstrip(".")
    return f"{clause[0].lower()}{clause[1:]}" if clause[1:2].islower() or clause[1:2] == " " else clause


def beyond(value: float, limit: float) -> str:
    """A value with two digits, rounded away from the limit that it is beyond, so that it does not read as the limit."""
    hundredths = 100.0 * value
    return f"{(math.ceil(hundredths - 1e-6) if value > limit else math.floor(hundredths + 1e-6)) / 100:.2f}"


def say(sentence: str) -> None:
    """Say something to the crew on standard error, wrapped between words if lines have a width.

    A program goes on where nobody listens any more, or where the disk that keeps its words is full.
    """
    line = printable(sentence, MARK, "\n\t")
    if sys.stderr.isatty() or os.environ.get("COLUMNS", "").isdigit():
        line = wrapped(line, shutil.get_terminal_size().columns)
    with suppress(OSError):
        print(line, file=sys.stderr)


def say_warning(sentence: str) -> None:
    """Warn the crew on standard error."""
    say(f"warning: {sentence}")


def wrapped(text: str, width: int) -> str:
    """Wrap `text` into lines of `width`, broken between words; a longer word, such as a path, stays whole."""
    return "\n".join(
        textwrap.fill(line, width, break_long_words=False, break_on_hyphens=False)
        for line in text.split("\n")
    )
