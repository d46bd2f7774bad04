"""What an effect is: a name, a sentence, parameters, and what it adds to forces and readings along a course."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course

Array = NDArray[np.float64]
Place = Literal["force", "thruster", "reading", "water", "body"]


@dataclass(frozen=True)
class Act:
    """What an effect adds along a course: to the wrench (n, 6), N and N m, about the origin; to the readings of the
    DVL (n, 3), the gyros (n, 3), the attitude (n, 3) and the accelerometer (n, 3), body axes; and to the total masses
    and linear dampings (6,) of the nominal model. None: nothing."""

    wrench: Array | None = None
    mass: Array | None = None
    damping: Array | None = None
    velocity: Array | None = None
    gyro: Array | None = None
    attitude: Array | None = None
    specific_force: Array | None = None


@dataclass(frozen=True)
class Parameter:
    """One number of an effect, in SI units: at `none` the effect is absent, at `start` it shows; low, high: what is
    possible."""

    name: str
    unit: str
    start: float
    low: float = -np.inf
    high: float = np.inf
    none: float = 0.0


@dataclass(frozen=True)
class Effect:
    """An effect of the library. `act` gives what it adds for the values (p,) of its parameters.

    sentence: what it is, for a crew. told_apart: what tells it from those that look like it. linear: what it adds is
    proportional to its parameters. number: which thruster it is about, from 1; 0 for all. needs: what the recording
    must hold beside velocity and thrust.
    """

    name: str
    sentence: str
    place: Place
    parameters: tuple[Parameter, ...]
    act: Callable[[Course, Array], Act]
    told_apart: str
    linear: bool = True
    number: int = 0
    needs: tuple[str, ...] = field(default=())

    @property
    def label(self) -> str:
        """The name, and the thruster's number where it is about one."""
        return f"{self.name} of thruster {self.number}" if self.number else self.name

    def none(self) -> Array:
        """(p,) the parameters at which it is absent."""
        return np.array([p.none for p in self.parameters])

    def start(self) -> Array:
        """(p,) parameters at which it shows."""
        return np.array([p.start for p in self.parameters])
