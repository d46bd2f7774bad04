"""The quantities that are drawn: names, smallest range of the axis, direction of the axis."""

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True)
class Quantity:
    """One trace of a `Picture`. `least_span` and `digits` are in the displayed unit."""

    key: str
    title: str
    least_span: float
    digits: int
    with_zero: bool = False
    downwards: bool = False
    turns: bool = False


_ALL: Final = (
    Quantity("u", "surge u", 0.2, 3, with_zero=True),
    Quantity("v", "sway v", 0.2, 3, with_zero=True),
    Quantity("w", "heave w", 0.2, 3, with_zero=True),
    Quantity("r", "yaw r", 10.0, 1, with_zero=True),
    Quantity("depth", "depth", 0.5, 2, downwards=True),
    Quantity("heading", "heading", 20.0, 1, turns=True),
    Quantity("altitude", "altitude", 0.5, 2),
    Quantity("voltage", "battery", 1.0, 2),
    Quantity("p", "roll p", 10.0, 1, with_zero=True),
    Quantity("q", "pitch q", 10.0, 1, with_zero=True),
    Quantity("current", "current", 5.0, 1, with_zero=True),
)
QUANTITIES: Final = {quantity.key: quantity for quantity in _ALL}
