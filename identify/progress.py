"""How an estimator reports its progress. Light: the command line shows progress without loading numpy."""

from collections.abc import Mapping
from typing import Protocol

Values = Mapping[str, tuple[float, float]]
"""Parameters fitted so far: value and half of the 95 % interval by name, SI units."""

NO_VALUES: Values = {}


class Progress(Protocol):
    """Takes the share that is done (0 to 1), what is done now in words, and the values so far if there are any."""

    def __call__(self, share: float, words: str, values: Values = NO_VALUES, /) -> None: ...
