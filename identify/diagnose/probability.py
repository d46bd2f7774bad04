"""Probability of a cause, by the margin of the best explanation without it.

Held-out nats would be log odds for a library that holds the truth and noise like the dive's. Neither is exact, and a
margin is worth less: the curve was calibrated on drawn dives with known causes. `make bench` shows its calibration on
others.
"""

MOST_PROBABLE, HALF_NATS = 0.98, 6.0
"""Probability at infinite margin, and the margin for half of it."""

TAKEN_UP = 0.25
"""Share of the nats of unexplained forces that a cause may have taken up by its wrong form."""

LIKELY = 0.5
"""A less probable cause is called possible: neither asserted nor accepted."""


def probability(margin_nats: float, unexplained_nats: float = 0.0) -> float:
    """Probability that a cause, or a member of its ambiguity group, is present, given unexplained forces of so many
    nats.

    The margin counts by its share of the margin and the nats that the cause may have taken up from these forces: next
    to a large unknown force a small margin means little, while a large margin keeps its value.
    """
    margin = min(max(margin_nats, 0.0), 1e6)
    margin *= margin / max(margin + TAKEN_UP * unexplained_nats, 1e-9)
    return MOST_PROBABLE * margin / (margin + HALF_NATS)
