"""The lines of a page's figures, as points."""

import re

import numpy as np

from identify.dive import Array

NUMBER = r"-?(?:\d+\.?\d*|\.\d+)"


def strokes(path: str) -> list[Array]:
    """Each stroke of a path that begins somewhere and goes on by steps, as points (n, 2), y downwards."""
    found = []
    for stroke in filter(None, path.split("M")):
        steps = np.array(re.findall(NUMBER, stroke), dtype=float).reshape(-1, 2)
        found.append(np.cumsum(steps, axis=0))
    return found
