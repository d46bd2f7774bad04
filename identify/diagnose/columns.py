"""What causes add to the rows of a ground, made once for each and kept: a search asks for most of them many times."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course
from bridge.effects.effect import Act, Effect
from identify.diagnose.blocks import Blocks
from identify.diagnose.cause import Cause, Setting, settings_of
from identify.diagnose.forms import forms
from identify.diagnose.whitened import Whitened

Array = NDArray[np.float64]
Key = tuple[Effect, bytes]

KEPT = 32
"""So many of the last causes: a long dive's columns take a megabyte each."""


def key_of(cause: Cause) -> Key:
    """Causes with the same add the same."""
    return cause.effect, cause.values.tobytes()


@dataclass(frozen=True)
class Columns:
    """Of the causes of a library along a course."""

    rows: Whitened
    course: Course
    library: tuple[Effect, ...]

    @cached_property
    def settings(self) -> tuple[Setting, ...]:
        """All ways to try the library."""
        return self._tried[0]

    @cached_property
    def candidates(self) -> Blocks:
        """The columns of the settings."""
        return self.rows.blocks(self._tried[1], self.course)

    @cached_property
    def _tried(self) -> tuple[tuple[Setting, ...], list[Act]]:
        return settings_of(self.library, self.course)

    def of(self, cause: Cause) -> Array:
        """(1 + k, rows): what a cause adds, and what that changes by with each parameter that it has."""
        if cause.effect.linear:
            return self._of_linear(cause)
        return self._last(*key_of(cause))

    def forms_of(self, cause: Cause) -> Array:
        """(k, rows): what other forms of a cause add."""
        key = key_of(cause)
        if key not in self._other:
            self._other[key] = self.rows.columns(list(forms(self.course, cause)), self.course).T
        return self._other[key]

    @cached_property
    def _last(self) -> Callable[[Effect, bytes], Array]:
        """Those of the last causes that were asked for."""
        return lru_cache(KEPT)(partial(_whitened, self.rows, self.course))

    def _of_linear(self, cause: Cause) -> Array:
        """What is proportional to its parameters is made of what a unit of each adds."""
        if cause.effect not in self._by_unit:
            self._by_unit[cause.effect] = self._units(cause.effect)
        slopes, present = self._by_unit[cause.effect], cause.present
        own = (cause.values - cause.effect.none())[present] @ slopes[present]
        return np.vstack([own, slopes[present]])

    def _units(self, effect: Effect) -> Array:
        """(p, rows): from the columns by which it is tried, once these are made."""
        if "candidates" in vars(self) and effect in self.library:
            setting = next(one for one in self.settings if one.effect == effect)
            tried = self.candidates.some(setting.columns)
        else:
            (setting,), acts = settings_of((effect,), self.course)
            tried = self.rows.columns(acts, self.course)
        return tried.T / np.diag(setting.steps)[:, None]

    @cached_property
    def _other(self) -> dict[Key, Array]:
        return {}

    @cached_property
    def _by_unit(self) -> dict[Effect, Array]:
        return {}


def _whitened(rows: Whitened, course: Course, effect: Effect, values: bytes) -> Array:
    cause = Cause(effect, np.frombuffer(values))
    acts = [cause.act(course)]
    acts += [cause.slope(course, p) for p in np.flatnonzero(cause.present).tolist()]
    return rows.columns(acts, course).T
