"""The grammar of a drawn force: degrees of freedom, inputs, parity, memory, timing.

force   = degrees of freedom, factors, memory, timing, rhythm
degrees = one | two
factors = signal parity power | signal parity power, signal parity power | none, for a force of time alone
signal  = a velocity | an acceleration | a thrust | a thruster's pulse | an attitude | depth
memory  = none | lag | delay | leaky integral | hysteresis
timing  = steady | from a time on | for a while | bursts | slow drift
rhythm  = none | a period
"""

from dataclasses import dataclass
from typing import Literal, TypeVar

import numpy as np

from bridge.arrays import Array
from identify.challenge.scenario import (
    ACCELERATION,
    ATTITUDE,
    DELAY,
    DEPTH,
    INSTANT,
    LAG,
    LEAK,
    NOTHING,
    PLAY,
    PULSE,
    THRUST,
    VELOCITY,
    DrawnForce,
)

Sort = Literal["velocity", "acceleration", "thrust", "pulse", "attitude", "depth"]
Memory = Literal["none", "lag", "delay", "leaky integral", "hysteresis"]
Timing = Literal["steady", "from a time on", "for a while", "bursts", "slow drift"]
Word = TypeVar("Word", Memory, Timing)

DOF_SHARES = (0.2, 0.2, 0.2, 0.1, 0.1, 0.2)
TWO_SHARE, TIME_ALONE_SHARE, PRODUCT_SHARE = 0.25, 0.15, 0.25
"""Shares of forces in two degrees of freedom, of forces of time alone, and of forces with two factors."""

LEVERS_M = (1.0, 1.0, 1.0, 0.2, 0.2, 0.2)
"""Size of a moment per newton of force, N m, by degree of freedom; 1 for a force."""

BEGINS: dict[Sort, tuple[int, int]] = {
    "velocity": (VELOCITY, 6),
    "acceleration": (ACCELERATION, 6),
    "thrust": (THRUST, 6),
    "pulse": (PULSE, 0),
    "attitude": (ATTITUDE, 3),
    "depth": (DEPTH, 1),
}
"""First signal of a sort, and the number of its signals; 0 for pulses, which have as many signals as thrusters."""

NO_THRUST = (3, 4)
"""Degrees of freedom in which no controller pushes."""

POWERS = (0.5, 3.0)
MEMORIES: dict[Memory, float] = {
    "none": 0.5, "lag": 0.15, "delay": 0.15, "leaky integral": 0.1, "hysteresis": 0.1,
}  # fmt: skip
REMEMBERED_S: dict[Memory, tuple[float, float]] = {
    "lag": (0.5, 5.0), "delay": (0.3, 3.0), "leaky integral": (5.0, 40.0),
}  # fmt: skip
PLAYS = (0.3, 1.0)
"""Range of the half-widths of hysteresis, in typical sizes of the input."""

TIMINGS: dict[Timing, float] = {
    "steady": 0.5, "from a time on": 0.15, "for a while": 0.1, "bursts": 0.125, "slow drift": 0.125,
}  # fmt: skip
RHYTHM_SHARE, RHYTHM_ALONE_SHARE = 0.2, 0.6
PERIODS_S = (1.0, 60.0)
SOFT_S = 1.0
"""Time in which a force fades in or out."""

BURST_EVERY_S, BURST_S = 20.0, (1.0, 6.0)


@dataclass(frozen=True)
class Factor:
    """A factor of a force: sort of its signal and axis or thruster (from 0), parity, and power of the magnitude."""

    sort: Sort
    axis: int
    even: bool
    power: float

    @property
    def signal(self) -> int:
        return BEGINS[self.sort][0] + self.axis


@dataclass(frozen=True)
class Sentence:
    """One force of the grammar: what is drawn of it before it is fitted into a dive.

    dofs: one or two degrees of freedom; gains: relative size in each; remembered: s, or half-width of hysteresis;
    begin, end: shares of the dive between which the force acts; period_s: 0 for no rhythm; seed: of its bursts and
    its walk.
    """

    dofs: tuple[int, ...]
    gains: tuple[float, ...]
    factors: tuple[Factor, ...]
    memory: Memory
    remembered: float
    timing: Timing
    begin: float
    end: float
    period_s: float
    phase: float
    seed: int

    @property
    def goes_with(self) -> str:
        """Its factors' sort in a word or two."""
        if not self.factors:
            return "time alone"
        return self.factors[0].sort if len(self.factors) == 1 else "two of these"

    @property
    def parity(self) -> str:
        """Parity of the whole force in its factors."""
        if not self.factors:
            return "neither"
        return "even" if sum(not factor.even for factor in self.factors) % 2 == 0 else "odd"

    @property
    def rhythm(self) -> str:
        return "a period" if self.period_s > 0 else "none"


def draw_sentence(rng: np.random.Generator, thrusters: int) -> Sentence:
    """Draw a force for a vehicle with `thrusters` thrusters."""
    count = 2 if rng.random() < TWO_SHARE else 1
    dofs = tuple(sorted(int(dof) for dof in rng.choice(6, count, replace=False, p=DOF_SHARES)))
    gains = tuple(float(way * rng.uniform(0.5, 1.0)) * LEVERS_M[dof] for dof, way in _ways(rng, dofs))
    kind = rng.random()
    factors = 0 if kind < TIME_ALONE_SHARE else 2 if kind < TIME_ALONE_SHARE + PRODUCT_SHARE else 1
    memory = _one_of(rng, MEMORIES) if factors else "none"
    timing = _one_of(rng, TIMINGS)
    lasting = rng.uniform(0.1, 0.4)
    begin = float(rng.uniform(0.1, 0.7)) if timing in ("from a time on", "for a while") else 0.0
    rhythmic = rng.random() < (RHYTHM_SHARE if factors else RHYTHM_ALONE_SHARE)
    low, high = REMEMBERED_S.get(memory, PLAYS)
    return Sentence(
        dofs,
        gains,
        tuple(_factor(rng, thrusters) for _ in range(factors)),
        memory,
        _between(rng, low, high),
        timing,
        begin,
        begin + float(lasting) if timing == "for a while" else 1.0,
        _between(rng, *PERIODS_S) if rhythmic else 0.0,
        float(rng.uniform(0, 2 * np.pi)),
        int(rng.integers(2**31)),
    )


def force_of(sentence: Sentence, time_s: Array, middle: Array, scale: Array) -> DrawnForce:
    """A drawn force in the simulator's form, of size one, over the steps (n,) of a dive.

    middle, scale (factors,): mean and typical deviation of each signal.
    """
    size = np.zeros(6)
    size[list(sentence.dofs)] = sentence.gains
    signal, even = np.full(2, NOTHING), np.zeros(2, np.int64)
    about, typical, power = np.zeros(2), np.ones(2), np.ones(2)
    for i, factor in enumerate(sentence.factors):
        signal[i], even[i], power[i] = factor.signal, factor.even, factor.power
        about[i], typical[i] = middle[i], scale[i]
    code = {"none": INSTANT, "lag": LAG, "delay": DELAY, "leaky integral": LEAK, "hysteresis": PLAY}
    return DrawnForce(
        size, signal, about, typical, power, even, envelope(sentence, time_s), code[sentence.memory],
        sentence.remembered, sentence.remembered,
    )  # fmt: skip


def envelope(sentence: Sentence, time_s: Array) -> Array:
    """Factor (n,) on a force at the times (n,) of a dive, s: when it acts, and its rhythm."""
    rng = np.random.default_rng(sentence.seed)
    duration_s = float(time_s[-1] - time_s[0])
    since_s = time_s - time_s[0]
    out = np.ones(len(time_s))
    if sentence.timing in ("from a time on", "for a while"):
        out *= np.clip((since_s - sentence.begin * duration_s) / SOFT_S, 0.0, 1.0)
        if sentence.end < 1.0:
            out *= np.clip((sentence.end * duration_s - since_s) / SOFT_S, 0.0, 1.0)
    elif sentence.timing == "bursts":
        out = _bursts(rng, since_s, both=not sentence.factors)
    elif sentence.timing == "slow drift":
        walk = np.cumsum(rng.standard_normal(len(time_s)))
        out = walk / np.sqrt(np.mean(walk**2))
    if sentence.period_s > 0:
        out = out * np.sin(2 * np.pi * since_s / sentence.period_s + sentence.phase)
    return out


def _bursts(rng: np.random.Generator, since_s: Array, both: bool) -> Array:
    """Half waves of drawn lengths at drawn times; `both`: of either sign."""
    out, at = np.zeros(len(since_s)), 0.0
    while True:
        at += rng.exponential(BURST_EVERY_S)
        long = rng.uniform(*BURST_S)
        if at + long > since_s[-1]:
            return out
        part = (since_s >= at) & (since_s < at + long)
        way = rng.choice([-1.0, 1.0]) if both else 1.0
        out[part] = way * np.sin(np.pi * (since_s[part] - at) / long)
        at += long


def _factor(rng: np.random.Generator, thrusters: int) -> Factor:
    sort: Sort = list(BEGINS)[rng.integers(len(BEGINS))]
    axis = int(rng.integers(thrusters if sort == "pulse" else BEGINS[sort][1]))
    while sort == "thrust" and axis in NO_THRUST:
        axis = int(rng.integers(6))
    return Factor(sort, axis, bool(rng.random() < 0.5), _between(rng, *POWERS))


def _ways(rng: np.random.Generator, dofs: tuple[int, ...]) -> list[tuple[int, float]]:
    return [(dof, float(rng.choice([-1.0, 1.0]))) for dof in dofs]


def _one_of(rng: np.random.Generator, shares: dict[Word, float]) -> Word:
    return list(shares)[rng.choice(len(shares), p=list(shares.values()))]


def _between(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw evenly in logarithms."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
