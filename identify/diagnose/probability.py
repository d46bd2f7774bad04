"""How probable a cause is, by how far the best explanation without it falls behind.

Nats on pieces held out are odds where the library holds the truth and its noise is the dive's. Neither is quite so: the
odds are held to what dives with known causes came to (`make bench`, expected calibration error).
"""

import math

SURE, HALF_NATS, SCALE_NATS = 0.97, 3.0, 2.0
"""The most that any evidence comes to, and the logistic curve towards it."""


def probability(margin_nats: float) -> float:
    """That a cause, or one that can't be told from it, is present."""
    return SURE / (1.0 + math.exp(-(min(margin_nats, 500.0) - HALF_NATS) / SCALE_NATS))
