"""An accepted effect as it is kept in files."""

from dataclasses import dataclass


@dataclass(frozen=True)
class AcceptedEffect:
    """An effect of the library by name and label, with its parameters there in SI units; `number`: of its thruster,
    from 1, 0 for all."""

    name: str
    label: str
    parameters: dict[str, float]
    number: int = 0
