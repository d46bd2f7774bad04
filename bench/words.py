"""Text layout of the page."""

import textwrap

WIDTH = 118


def paragraph(*sentences: str) -> list[str]:
    """Wrap the sentences into lines of the page."""
    return textwrap.wrap(" ".join(sentences), WIDTH, break_long_words=False, break_on_hyphens=False)
