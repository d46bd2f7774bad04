"""Which of the values of a long test stay in `make test`; `make soak` runs the others."""

from collections.abc import Iterable
from typing import Any

import pytest


def rest_in_soak(values: Iterable[Any], keep: int = 1) -> list[Any]:
    """For `parametrize` with one name: the first `keep` values as they are, the rest for `make soak`."""
    return [
        value if n < keep else pytest.param(value, marks=pytest.mark.soak) for n, value in enumerate(values)
    ]


def rows_rest_in_soak(rows: Iterable[tuple[Any, ...]], keep: int = 1) -> list[Any]:
    """The same for `parametrize` with several names."""
    return [row if n < keep else pytest.param(*row, marks=pytest.mark.soak) for n, row in enumerate(rows)]
