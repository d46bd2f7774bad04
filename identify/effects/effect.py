"""Definition of an effect: name, sentence, parameters, and its contribution to forces and readings along a course."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, fields, replace
from typing import Any, Literal

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.config import Configuration
from identify.effects.course import Course

ActsOn = Literal["force", "thruster", "reading", "water", "body", "log"]
FeedForward = Literal[
    "", "nominal", "quadratic_drag", "coupling", "thruster_gain", "reverse_loss", "dead_zone", "voltage"
]
"""Parameter groups with which the feed-forward on the vehicle can compensate an effect."""

COMPENSATED_BY: dict[FeedForward, str] = {
    "nominal": "masses and dampings",
    "quadratic_drag": "quadratic drag",
    "coupling": "coupling terms",
    "thruster_gain": "a gain for each thruster",
    "reverse_loss": "the loss in reverse",
    "dead_zone": "the dead zone",
    "voltage": "the measured voltage",
}
"""These groups in words."""

SIMULATED: frozenset[FeedForward] = frozenset(
    {"nominal", "quadratic_drag", "thruster_gain", "reverse_loss", "dead_zone"}
)
"""The groups whose coefficients the vehicle's simulator has."""

ModelPart = Literal[
    "",
    "quadratic",
    "gain",
    "reverse_gain",
    "dead_zone_n",
    "least_n",
    "limit_n",
    "direction",
    "lag_s",
    "other_lag_s",
    "net_buoyancy_n",
    "current_m_s",
]
"""Parts of a model for other simulators (`export.model.Model` and its propellers)."""


PULSES, QUICK_COMMANDS, OWN_VELOCITY = "pulses", "quick commands", "a sensor's own velocity"
OWN_DESCENT = "no speed up and down that is made of the depth itself"
"""Requirements of effects on a recording: each thruster's own command, commands known at all times, a velocity that no
autopilot has filtered, and a speed up and down that is not the depth's own rate."""

SIZES = (0.5, 1.0, 2.0, 4.0)
"""Sizes to try for an effect whose shape changes with its size."""


@dataclass(frozen=True)
class Act:
    """The contribution of an effect along a course: to the wrench (n, 6), N and N m, about the origin; to the
    readings of the DVL (n, 3), the gyros (n, 3), the attitude (n, 3) and the accelerometer (n, 3), body axes; to the
    depth that is read (n, 1), m; and to the total masses and linear dampings (6,) of the nominal model. None means no
    contribution.

    A change of `mass` or `damping` changes the nominal model's own parameters: a refit absorbs it completely, and
    only a comparison with previously accepted parameters reveals it. `shaft_n` (n, k): the part of the thrusts that
    shows in shaft speeds, N; it is included in `wrench`, and must not be added again if the thrusts are taken from
    the shaft speeds. `quadratic` (6,): drag by the square of the speed, included in `wrench` too. `water` (n, 3): the
    water's own velocity, body axes, by which readings over ground exceed the velocity through the water.
    """

    wrench: Array | None = None
    mass: Array | None = None
    damping: Array | None = None
    velocity: Array | None = None
    gyro: Array | None = None
    attitude: Array | None = None
    specific_force: Array | None = None
    depth: Array | None = None
    shaft_n: Array | None = None
    quadratic: Array | None = None
    water: Array | None = None

    @property
    def beyond(self) -> Array | None:
        """Excess of velocity readings over the velocity through the water, (n, 3); None if there is no excess."""
        if self.velocity is None or self.water is None:
            return self.water if self.velocity is None else self.velocity
        return np.asarray(self.velocity + self.water)

    @property
    def is_none(self) -> bool:
        """Whether it contributes nothing."""
        return not any(np.any(part) for name in ARRAYS if (part := getattr(self, name)) is not None)

    def each(self, change: Callable[[Array], Array]) -> "Act":
        """Return a copy with `change`, (n, ...) to (n, ...), applied to every part along the course; a drag that is
        changed so is no longer one by the square of the speed."""
        parts: dict[str, Any] = {
            name: change(part) for name in ALONG if (part := getattr(self, name)) is not None
        }
        return replace(self, **parts, quadratic=None)

    def less(self, other: "Act") -> "Act":
        """Return this act minus another act of the same effect."""

        def apart(name: str) -> Array | None:
            minuend, subtrahend = getattr(self, name), getattr(other, name)
            return None if minuend is None else minuend - subtrahend

        parts: dict[str, Any] = {name: apart(name) for name in ARRAYS}
        return replace(self, **parts)

    def times(self, size: float) -> "Act":
        """Return this act multiplied by `size`."""
        parts: dict[str, Any] = {
            name: size * part for name in ARRAYS if (part := getattr(self, name)) is not None
        }
        return replace(self, **parts)


ARRAYS = tuple(field.name for field in fields(Act))

ALONG = ("wrench", "water", "velocity", "gyro", "attitude", "specific_force", "depth", "shaft_n")
"""The parts of an act that vary with time."""


@dataclass(frozen=True)
class Parameter:
    """A parameter of an effect, in SI units: at `none` the effect is absent, at `start` it shows. `low` and `high`
    bound the possible values; a bound is certain if it is one of the two values `sure` (no effect, full effect),
    otherwise a guess. Values above `seldom_above` are possible, but of causes that do as well one without them is
    preferred."""

    name: str
    unit: str
    start: float
    low: float = -np.inf
    high: float = np.inf
    none: float = 0.0
    exact: tuple[float, float] = (0.0, 1.0)
    seldom_above: float = np.inf

    def at_guess(self, value: float) -> bool:
        """Whether a value lies at a bound that is a guess."""
        return value in (self.low, self.high) and value not in self.exact


AnswerParameters = dict[str, tuple[float, str]]
"""Parameters of an answer by name: value and unit of each."""


@dataclass(frozen=True)
class Compensation:
    """A coefficient of the feed-forward that compensates an effect: `slope` times the distance of the parameter `of`
    from `none`; if `of` is "", it is `slope` itself, a constant that was not estimated."""

    name: str
    unit: str
    of: str = ""
    slope: float = 1.0
    none: float = 0.0


def compensated_by(*coefficients: Compensation) -> Callable[[Course], tuple[Compensation, ...]]:
    """Compensation by the same coefficients along every course."""
    return lambda _: coefficients


def compensated_by_name(*parameters: Parameter) -> Callable[[Course], tuple[Compensation, ...]]:
    """Compensation by coefficients of the parameters' own names and values."""
    return compensated_by(*(Compensation(p.name, p.unit, p.name) for p in parameters))


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
    """An effect of the library: a cause for which a vehicle moves otherwise than its nominal model says.

    - name: as in answers and accepted effects.
    - acts_on: a force on the hull, a thruster, a sensor's reading, the water, the body (masses, thruster
      positions), or the log (which stamps what is recorded).
    - parameters: what is estimated of it, with units, the values at which it is absent, and bounds.
    - act: returns its contribution for the values (p,) of its parameters. An effect without parameters adds nothing
      to a course and is detected by other evidence.
    - sentence: description for a crew.
    - less: the sentence for a size below `none`, "" if `sentence` serves; is_less: whether the size is below.
    - separation: manoeuvres and sensors that distinguish it from similar effects.
    - linear: its contribution is proportional to the distance of its parameters from `none`.
    - number: the thruster that it concerns, from 1; 0 for all. one_of: how many forms and thrusters it is sought in.
    - needs: data that the recording must hold in addition to motion and thrust (`PULSES`, `QUICK_COMMANDS`,
      `OWN_VELOCITY`, `OWN_DESCENT` or the name of a signal); otherwise the effect is not tried.
    - growth_is_apart: its growth over a dive counts as a different effect.
    - feedforward: the parameter group with which the feed-forward compensates it, "" if it can't.
    - variant: the form, if several forms share a name; they are the same cause.
    - refit_absorbs: a refit of the nominal model absorbs it and leaves almost nothing of it.
    - possible: whether nature allows its values along a course; None if it allows all within their bounds.
    - telling: converts its values to the parameters of an answer, if these differ.
    - compensation: the coefficients of the feed-forward that make up for it along a course; None if there are none.
    - caveat: a remark for the crew once it is accepted.
    - evidence: why nats say nothing of it, if it rests on another test.
    - model_part: the part of a model for other simulators that holds it, "" if none does. about: the body axis, x, y
      or z, about which it turns that part.
    - companions: further acts along a course, of any size, that come with its act.
    - sea: its periods are read off the dive, and it has parameters for each.
    - witnessed: a sensor of its own identifies it, without the motion, and no other effect can mimic it.
    - lasting: it belongs to the vehicle; otherwise to a single dive, as water and tether do.
    - timing: how it makes the thrust late, by a "lag" or a "delay"; "" if it does not.
    - sizes: multiples of the distance from `none` to `start` at which it is tried (for a limit: the most that was
      asked over one more than the size); more than one if its shape changes with its size.
    - steep: its shape changes so abruptly that a size holds for no other than itself.
    - sudden: it may begin within a dive, as when a propeller breaks.
    - may_be: an effect that may be the cause instead, with its values given this one's: a refit absorbs it unless this
      effect's sensor is recorded.
    - in_file: what the vehicle file gives of it, in newtons or metres, while thrust is known to its scale alone.
    - since_s: time since the recording's start from which it acts, if it began within the dive (`beginning`). until_s:
      the same to which it acts, if it ended within it; inf if it did not.
    """

    name: str
    sentence: str
    acts_on: ActsOn
    parameters: tuple[Parameter, ...]
    act: Callable[[Course, Array], Act]
    separation: Separation
    linear: bool = True
    number: int = 0
    one_of: int = field(default=1, compare=False)
    needs: tuple[str, ...] = field(default=())
    growth_is_apart: bool = False
    feedforward: FeedForward = ""
    variant: str = ""
    refit_absorbs: bool = False
    possible: Callable[[Course, Array], bool] | None = None
    telling: Callable[[Array], AnswerParameters] | None = None
    compensation: Callable[[Course], tuple[Compensation, ...]] | None = None
    caveat: str = ""
    evidence: str = ""
    model_part: ModelPart = ""
    about: str = ""
    companions: Callable[[Course, Act], Iterator[Act]] | None = None
    sea: bool = False
    witnessed: bool = False
    lasting: bool = True
    timing: Literal["", "lag", "delay"] = ""
    sizes: tuple[float, ...] = (1.0,)
    steep: bool = False
    sudden: bool = False
    may_be: "tuple[Effect, Callable[[Array], Array]] | None" = None
    in_file: Callable[[Configuration], float] | None = None
    since_s: float = 0.0
    until_s: float = math.inf
    less: str = ""
    is_less: bool = False
    _throughout: "Effect | None" = None

    @property
    def throughout(self) -> "Effect":
        """The effect as it acts in further dives: from their start."""
        return self._throughout or self

    @property
    def in_coefficients(self) -> bool:
        """Whether the masses and dampings of a dive already contain it."""
        return self.refit_absorbs and bool(self.feedforward)

    @property
    def label(self) -> str:
        """The name, with the thruster's number if it concerns a single thruster, the variant if it has several, and
        its beginning within a dive."""
        subject = f"{self.name} of thruster {self.number}" if self.number else self.name
        form = f"{subject} ({self.variant})" if self.variant else subject
        if self.has_ended:
            return f"{form} from {self.since_s:g} to {self.until_s:g} s"
        return f"{form} since {self.since_s:g} s" if self.since_s else form

    @property
    def has_ended(self) -> bool:
        """Whether it ended within the dive."""
        return math.isfinite(self.until_s)

    def none(self) -> Array:
        """Parameters (p,) at which the effect is absent."""
        return np.array([p.none for p in self.parameters])

    def start(self) -> Array:
        """Parameters (p,) at which the effect shows."""
        return np.array([p.start for p in self.parameters])

    def answer_parameters(self, values: Array) -> AnswerParameters:
        """Return its parameters by the names of an answer, with the thruster's number if it concerns a single
        thruster."""
        answer: AnswerParameters = {"thruster": (float(self.number), "1")} if self.number else {}
        if self.telling is not None:
            return answer | self.telling(values)
        return answer | {p.name: (float(v), p.unit) for p, v in zip(self.parameters, values, strict=True)}


def beginning(effect: Effect, since_s: float, start_s: float, until_s: float = math.inf) -> Effect:
    """The effect, beginning `since_s` after the start of a recording, which is at `start_s` of a course's clock, and
    ending `until_s` after it. One that ended is no longer the vehicle's."""

    def act(course: Course, values: Array) -> Act:
        within = (course.time_s >= start_s + since_s) & (course.time_s < start_s + until_s)
        return effect.act(course, values).each(lambda part: within[:, None] * part)

    return replace(
        effect,
        act=act,
        since_s=since_s,
        until_s=until_s,
        sudden=False,
        lasting=effect.lasting and math.isinf(until_s),
        _throughout=effect,
    )


def past_the_shaft(course: Course, more_n: Array) -> Act:
    """Contribution of thrusts (n, k) in excess of the nominal ones, while the shafts turn as asked."""
    return Act(wrench=course.wrench_of(more_n))


def before_the_shaft(course: Course, more_n: Array) -> Act:
    """Contribution of thrusts (n, k) in excess of the nominal ones, because the shafts turn differently than asked."""
    return Act(wrench=course.wrench_of(more_n), shaft_n=more_n)
