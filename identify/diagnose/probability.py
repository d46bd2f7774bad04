"""How probable a cause is, by how far the best explanation without it falls behind.

Nats on pieces held out are odds where the library holds the truth and its noise is the dive's. Neither is quite so, and
a margin of some nats is worth less than that: the curve was set on drawn dives whose causes are known. How well it is
calibrated on others `make bench` tells.
"""

MOST_PROBABLE, HALF_NATS = 0.98, 6.0
"""The most that any evidence comes to, and the margin at which it comes to half of it."""

BESIDE_UNKNOWN = 0.5
"""By what a cause is less probable where something is left that nothing explains: it may stand for part of that."""

LIKELY = 0.5
"""A cause that is less probable is told as possible: it is neither asserted nor accepted."""


def probability(margin_nats: float) -> float:
    """That a cause, or one that can't be told from it, is present."""
    margin = min(max(margin_nats, 0.0), 1e6)
    return MOST_PROBABLE * margin / (margin + HALF_NATS)
