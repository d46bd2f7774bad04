"""How work on a dive reports its progress. Light: the command line shows progress without loading numpy."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

Values = Mapping[str, tuple[float, float]]
"""Parameters fitted so far: value and half of the 95 % interval by name, SI units."""

NO_VALUES: Values = {}


class Progress(Protocol):
    """Takes the share that is done (0 to 1), the present work in words, and the values so far if there are any."""

    def __call__(self, share: float, words: str, values: Values = NO_VALUES, /) -> None: ...


@dataclass(frozen=True)
class Step:
    """Progress of a work: the share that is done (0 to 1), the present work, the values so far.

    of: the method of an identification, or the name of the function. answered: the values are the final ones.
    """

    of: str
    share: float
    words: str
    values: Values = field(default_factory=dict)
    answered: bool = False


Steps = Callable[[Step], None]


def ignore_step(_: Step) -> None:
    """Ignore a step."""
