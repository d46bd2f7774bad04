"""Makes text from outside fit for a screen: a vehicle, a file or a name may hold characters that steer a terminal."""

import unicodedata


def printable(text: str, mark: str = "", keep: str = "") -> str:
    """Return `text` with `mark` for each character not in `keep` that could steer a terminal or hide in it.

    These are control characters (ESC, C1, line ends), characters that turn the direction of writing, and surrogates.
    """
    if text.isascii() and text.isprintable():
        return text
    return "".join(c if c in keep or _is_harmless(c) else mark for c in text)


def _is_harmless(character: str) -> bool:
    return character.isprintable() or unicodedata.category(character) == "Zs"


def as_clause(sentence: str) -> str:
    """A sentence for use inside another: without its stop, and small at its beginning, unless that is a name."""
    clause = sentence.rstrip(".")
    return f"{clause[0].lower()}{clause[1:]}" if clause[1:2].islower() or clause[1:2] == " " else clause
