"""What an effect is: a name, a sentence, parameters, and what it adds to forces and readings along a course."""

from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course

Array = NDArray[np.float64]
Place = Literal["force", "thruster", "reading", "water", "body", "log"]
FeedForward = Literal[
    "", "nominal", "quadratic_drag", "coupling", "thruster_gain", "reverse_loss", "dead_zone", "voltage"
]
"""The groups of parameters by which the feed-forward on board makes up for an effect."""


PULSES, QUICK_COMMANDS, OWN_VELOCITY = "pulses", "quick commands", "a sensor's own velocity"
"""What effects need of a recording: each thruster's own command, commands that are known all the
time, and a velocity that no autopilot has filtered."""

SIZES = (0.5, 1.0, 2.0, 4.0)
"""Of an effect whose shape changes with its size."""


@dataclass(frozen=True)
class Act:
    """What an effect adds along a course: to the wrench (n, 6), N and N m, about the origin; to the readings of the
    DVL (n, 3), the gyros (n, 3), the attitude (n, 3) and the accelerometer (n, 3), body axes; and to the total masses
    and linear dampings (6,) of the nominal model. None: nothing.

    A change of `mass` or `damping` is one of the nominal model's own parameters: a refit takes it up whole, and only
    what was accepted before tells of it. `shaft_n` (n, k): the part of the thrusts that shaft speeds show, N; it is
    in `wrench` too, and no longer to be added where the thrusts are taken from the shaft speeds. `quadratic` (6,):
    drag by the square of the speed, which is in `wrench` too. `water` (n, 3): the water's own velocity, body axes,
    which readings over ground have beyond the velocity through the water.
    """

    wrench: Array | None = None
    mass: Array | None = None
    damping: Array | None = None
    velocity: Array | None = None
    gyro: Array | None = None
    attitude: Array | None = None
    specific_force: Array | None = None
    shaft_n: Array | None = None
    quadratic: Array | None = None
    water: Array | None = None

    @property
    def beyond(self) -> Array | None:
        """(n, 3): what readings of velocity have beyond that through the water; None for nothing."""
        if self.velocity is None or self.water is None:
            return self.water if self.velocity is None else self.velocity
        return np.asarray(self.velocity + self.water)

    def each(self, change: Callable[[Array], Array]) -> "Act":
        """With a change done to all that it adds along the course, (n, ...) to (n, ...)."""
        parts: dict[str, Any] = {
            name: change(part) for name in ALONG if (part := getattr(self, name)) is not None
        }
        return replace(self, **parts)

    def less(self, other: "Act") -> "Act":
        """What it adds less what another of the same effect does."""

        def apart(name: str) -> Array | None:
            one, two = getattr(self, name), getattr(other, name)
            return None if one is None else one - two

        parts: dict[str, Any] = {name: apart(name) for name in ARRAYS}
        return replace(self, **parts)

    def times(self, size: float) -> "Act":
        """So many times what it adds."""
        parts: dict[str, Any] = {
            name: size * part for name in ARRAYS if (part := getattr(self, name)) is not None
        }
        return replace(self, **parts)


ARRAYS = tuple(field.name for field in fields(Act))

ALONG = ("wrench", "water", "velocity", "gyro", "attitude", "specific_force", "shaft_n")
"""The parts of an act that go with time."""


@dataclass(frozen=True)
class Parameter:
    """One number of an effect, in SI units: at `none` the effect is absent, at `start` it shows; low, high: what is
    possible, for sure at the values `sure` (nothing, all), elsewhere by guess."""

    name: str
    unit: str
    start: float
    low: float = -np.inf
    high: float = np.inf
    none: float = 0.0
    sure: tuple[float, float] = (0.0, 1.0)

    def at_guess(self, value: float) -> bool:
        """Whether a value lies at a bound that is a guess."""
        return value in (self.low, self.high) and value not in self.sure


Told = dict[str, tuple[float, str]]
"""Parameters by the names of an answer: value and unit of each."""


@dataclass(frozen=True)
class Separation:
    """What separates an effect from those that look like it: manoeuvres to dive, sensors to record."""

    manoeuvres: tuple[str, ...] = ()
    sensors: tuple[str, ...] = ()

    @property
    def every(self) -> tuple[str, ...]:
        return (*self.manoeuvres, *self.sensors)


@dataclass(frozen=True)
class Effect:
    """An effect of the library. `act` gives what it adds for the values (p,) of its parameters; one without parameters
    adds nothing that a course could show, and is found by other evidence.

    sentence: what it is, for a crew. linear: what it adds is
    proportional to its parameters less what they are at `none`. number: which thruster it is about, from 1; 0 for all.
    needs: what the recording must hold beside motion and thrust (`PULSES`, `QUICK_COMMANDS`, `OWN_VELOCITY`): without
    it the effect is not tried. seen_in_rpm: it happens before the shaft, which turns otherwise than its pulse asks for
    (`Act.shaft_n`); any other effect of a thruster leaves shaft speeds alone. growth_is_apart: where it grows over a
    dive, that is another effect.
    feedforward: by which parameters the feed-forward makes up for it, "" where it can't. variant: which of several
    forms under one name; they are one cause. refit_absorbs: a refit of the nominal model takes it up, all but nothing
    is left of it. telling: from its values to the parameters of an answer, where these are others. sizes: at how
    many times the way from `none` to `start` it is worth trying (a limit: at `start` over it), more than one where its
    shape changes with its size.
    """

    name: str
    sentence: str
    place: Place
    parameters: tuple[Parameter, ...]
    act: Callable[[Course, Array], Act]
    separation: Separation
    linear: bool = True
    number: int = 0
    needs: tuple[str, ...] = field(default=())
    seen_in_rpm: bool = False
    growth_is_apart: bool = False
    feedforward: FeedForward = ""
    variant: str = ""
    refit_absorbs: bool = False
    telling: Callable[[Array], Told] | None = None
    sizes: tuple[float, ...] = (1.0,)

    @property
    def label(self) -> str:
        """The name, the thruster's number where it is about one, and the variant where it has several."""
        whose = f"{self.name} of thruster {self.number}" if self.number else self.name
        return f"{whose} ({self.variant})" if self.variant else whose

    def none(self) -> Array:
        """(p,) the parameters at which it is absent."""
        return np.array([p.none for p in self.parameters])

    def start(self) -> Array:
        """(p,) parameters at which it shows."""
        return np.array([p.start for p in self.parameters])

    def told(self, values: Array) -> Told:
        """Its parameters as an answer names them, the thruster's number among them where it is about one."""
        whose: Told = {"thruster": (float(self.number), "1")} if self.number else {}
        if self.telling is not None:
            return whose | self.telling(values)
        return whose | {p.name: (float(v), p.unit) for p, v in zip(self.parameters, values, strict=True)}
