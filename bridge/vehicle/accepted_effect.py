"""An accepted effect as it is stored in files."""

from dataclasses import dataclass


@dataclass(frozen=True)
class AcceptedEffect:
    """An effect of the library by name and label, with its library parameters in SI units; `number`: its thruster,
    from 1, or 0 for all."""

    name: str
    label: str
    parameters: dict[str, float]
    number: int = 0
