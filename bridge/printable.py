"""Text from outside made fit for a screen: a vehicle, a file or a name may hold what steers a terminal."""

import unicodedata


def printable(text: str, mark: str = "", keep: str = "") -> str:
    """`text` with `mark` for each character that could steer a terminal or hide in it, but for those in `keep`.

    These are control characters (ESC, C1, line ends), those that turn the direction of writing, and surrogates.
    """
    if text.isascii() and text.isprintable():
        return text
    return "".join(c if c in keep or _is_harmless(c) else mark for c in text)


def _is_harmless(character: str) -> bool:
    return character.isprintable() or unicodedata.category(character) == "Zs"
