"""What was doubted of values that a command takes from a file: told wherever they go."""

from collections.abc import Collection, Mapping
from typing import Any

from bridge.vehicle.coefficients import OF_HULL
from identify.batch.doubts import clauses, doubts_in


def doubted_in(identification: Mapping[str, Any]) -> dict[str, str]:
    """What speaks against each coefficient that a doubt of an identification's JSON is about."""
    return clauses(doubts_in(identification), OF_HULL)


def told(doubted: Mapping[str, str], taken: Collection[str]) -> tuple[str, ...]:
    """A line for each doubted value of those that are taken."""
    return tuple(f"{name} is doubted: {why}" for name, why in doubted.items() if name in taken)
