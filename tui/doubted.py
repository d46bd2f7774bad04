"""Doubts about values that a command takes from a file, to be reported wherever the values go."""

from collections.abc import Collection, Mapping
from typing import Any

from bridge.vehicle.coefficients import OF_HULL
from identify.batch.rows import clauses, doubts_in


def doubted_in(identification: Mapping[str, Any]) -> dict[str, str]:
    """The reason against each coefficient that is the subject of a doubt in an identification's JSON."""
    return clauses(doubts_in(identification), OF_HULL)


def told(doubted: Mapping[str, str], taken: Collection[str]) -> tuple[str, ...]:
    """A line for each doubted value among those taken."""
    return tuple(f"{name} is doubted: {why}" for name, why in doubted.items() if name in taken)
