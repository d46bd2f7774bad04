"""A vehicle in its water before a dive, with all that a planted effect may change, and random forces; compiled."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.vehicle.config import GRAVITY_M_S2
from identify.challenge.equations_of_motion import Body, body
from identify.challenge.hull import Hull, Propellers, bare_hull
from identify.challenge.sensors import STEP_S, Faults, without_faults
from identify.challenge.vehicles import LAG_S, DrawnVehicle

VELOCITY, ACCELERATION, THRUST, ATTITUDE, DEPTH, PULSE, NOTHING = 0, 6, 12, 18, 21, 22, -1
"""First index of each group of signals: six degrees of freedom each of velocity, acceleration and thruster wrench;
roll, pitch and sine of heading; depth; one command per thruster. NOTHING: no signal.
"""

INSTANT, LAG, DELAY, LEAK, PLAY = 0, 1, 2, 3, 4
"""Kinds of memory of a force."""


class DrawnForce(NamedTuple):
    """A wrench `size` (6,), N and N m, times a shape that the vehicle's motion sets.

    The shape is the product of two factors, passed through a memory, times `when` (steps + 1,) or (1,). Each factor
    is ((signal - `middle`) / `scale`) to a `power`, odd or even. signal (2,): indices as above, NOTHING for a factor
    of 1. even (2,): 1 if the factor has no sign. memory: kind of memory of the product. memory_s: time constant of
    the lag, the delay, or the leak of the integral. play: half-width of hysteresis.
    """

    size: Array
    signal: NDArray[np.int64]
    middle: Array
    scale: Array
    power: Array
    even: NDArray[np.int64]
    when: Array
    memory: int = INSTANT
    memory_s: float = 1.0
    play: float = 0.0


def no_force() -> DrawnForce:
    return DrawnForce(
        np.zeros(6), np.full(2, NOTHING), np.zeros(2), np.ones(2), np.ones(2), np.zeros(2, np.int64), np.ones(1)
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def signal_of(place: int, state: Array, nu_dot: Array, thrust: Array, pulse: Array) -> float:
    """A signal of the vehicle: from the state (as in `state_derivative`), its acceleration (6,), the wrench of its
    thrusters (6,), or the commanded thrust of each thruster (k,).
    """
    if place < ACCELERATION:
        return float(state[7 + place])
    if place < THRUST:
        return float(nu_dot[place - ACCELERATION])
    if place < ATTITUDE:
        return float(thrust[place - THRUST])
    if place < DEPTH:
        w, x, y, z = state[3], state[4], state[5], state[6]
        if place == ATTITUDE:
            return float(np.arctan2(2 * (y * z + w * x), 1 - 2 * (x * x + y * y)))
        if place == ATTITUDE + 1:
            return float(np.arcsin(2 * (w * y - x * z)))
        return float(np.sin(np.arctan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z))))
    if place == DEPTH:
        return float(state[2])
    return float(pulse[place - PULSE])


@njit(cache=True, error_model="numpy")
def shape_of(force: DrawnForce, state: Array, nu_dot: Array, thrust: Array, pulse: Array) -> float:
    """Product of the factors at an instant."""
    product = 1.0
    for i in range(2):
        if force.signal[i] >= 0:
            x = signal_of(force.signal[i], state, nu_dot, thrust, pulse)
            x = (x - force.middle[i]) / force.scale[i]
            y = np.abs(x) ** force.power[i]
            product *= y if force.even[i] == 1 else np.sign(x) * y
    return product


@njit(cache=True, error_model="numpy")
def remembered(force: DrawnForce, product: float, step: int, step_s: float, past: Array) -> float:
    """Output of the memory for the product at a step; `past` (n,): the last n products, or the memory's only state."""
    if force.memory == LAG:
        past[0] += (1.0 - np.exp(-step_s / force.memory_s)) * (product - past[0])
        return float(past[0])
    if force.memory == LEAK:
        past[0] += step_s * (product - past[0] / force.memory_s)
        return float(past[0])
    if force.memory == PLAY:
        past[0] = min(max(past[0], product - force.play), product + force.play)
        return float(past[0])
    if force.memory == DELAY:
        at = step % len(past)
        late = float(past[at])
        past[at] = product
        return late
    return product


def past_of(force: DrawnForce, step_s: float) -> Array:
    """State of the memory before a dive."""
    late = max(round(force.memory_s / step_s), 1) if force.memory == DELAY else 1
    return np.zeros(late)


@njit(cache=True)
def _kept(white: Array, keep: float) -> None:
    fresh = np.sqrt(1.0 - keep * keep)
    for i in range(1, len(white)):
        for j in range(white.shape[1]):
            white[i, j] = keep * white[i - 1, j] + fresh * white[i, j]


def coloured(
    rng: np.random.Generator, steps: int, step_s: float, time_constant_s: float, poles: int, std: Array
) -> Array:
    """Gauss-Markov noise (steps, k) with one pole, or with two equal poles of the same mean memory."""
    out = rng.standard_normal((steps, len(std)))
    keep = float(np.exp(-step_s * poles / time_constant_s))
    for _ in range(poles):
        _kept(out, keep)
    if poles == 2:
        # Two equal poles in a row have a variance of (1 + k^2) / (1 - k^2).
        out *= np.sqrt((1 - keep**2) / (1 + keep**2))
    return np.asarray(out * std)


@dataclass
class Scenario:
    """Everything of one dive that can hide an effect; a plant changes it in place.

    time_s (n,): times of the steps, and one more. push (n, 6): planted wrench that depends on time alone. water (n,
    12): see `state_derivative`, None for still water. depth_m: at the beginning. fouled, fouled_s: see `dive.Scene`.
    sag, sag_s, ripple: drop of the recorded voltage with time and with load. drawn: a force of no effect's form.
    """

    vehicle: DrawnVehicle
    time_s: Array
    depth_m: float
    rigid: Array
    added: Array
    damping: Array
    hull: Hull
    prop: Propellers
    faults: Faults
    push: Array
    centre_m: float
    water: Array | None = None
    fouled: float = 0.0
    fouled_s: float = 1.0
    sag: float = 0.02
    sag_s: float = 600.0
    ripple: float = 0.0
    drawn: DrawnForce = field(default_factory=no_force)

    def body(self) -> Body:
        shape = self.vehicle.configuration
        weight_n = shape.dry_mass_kg * GRAVITY_M_S2
        return body(
            self.rigid, self.added, self.damping, np.array([0.0, 0.0, self.centre_m]), weight_n, shape.net_buoyancy_n,
            shape.dry_mass_kg,
        )  # fmt: skip

    def moving_water(self) -> Array:
        """Water motion (n, 12), to be added to; zeros if nothing has moved the water yet."""
        if self.water is None:
            self.water = np.zeros((len(self.time_s), 12))
        return self.water


def scenario_of(
    vehicle: DrawnVehicle, ticks: int, tick_steps: int, depth_m: float, floor_m: float
) -> Scenario:
    """A scenario in which the vehicle hides nothing."""
    shape = vehicle.configuration
    rigid = np.array([shape.dry_mass_kg] * 3 + list(shape.inertia_kgm2))
    time_s = STEP_S * np.arange(ticks * tick_steps + 1, dtype=np.float64)
    k = len(shape.thrusters)
    prop = Propellers(
        np.array([t.direction for t in shape.thrusters]),
        np.array([t.position_m for t in shape.thrusters]),
        np.ones(k),
        np.zeros(ticks),
        np.zeros(1),
        LAG_S,
        shape.thruster_limit_n,
    )
    return Scenario(
        vehicle, time_s, depth_m, np.diag(rigid), np.diag(vehicle.mass - rigid), np.diag(vehicle.damping),
        bare_hull(floor_m), prop, without_faults(vehicle.crew_arm), np.zeros((len(time_s), 6)),
        shape.centre_of_gravity_below_buoyancy_m,
    )  # fmt: skip


def sized(low: float, size: float) -> float:
    """`low` at size 0 and ten times `low` at size 1, linear in the logarithm."""
    return float(low * 10.0**size)


Apply = Callable[[Scenario, np.random.Generator], None]


def changed(
    part: Literal["hull", "prop", "faults"], **changes: Any
) -> Callable[[Any, np.random.Generator], None]:
    """An effect that sets parameters of a part of a scenario, alike in every dive."""

    def apply(scenario: Any, _: np.random.Generator) -> None:
        setattr(scenario, part, getattr(scenario, part)._replace(**changes))

    return apply


@dataclass(frozen=True)
class Planted:
    """A hidden effect. `apply` plants it in a dive's scenario; random values drawn there may differ by dive.

    parameters: the truth in the form of an answer, converted to the library's form if the planted form differs.
    number: of the thruster, from 1; 0 for all. size: 0 for the smallest that is drawn, 1 for the largest, which is
    ten times larger. spoils: degrees of freedom whose reading it falsifies; empty for a force. needs: `shallow` or
    `low` if it acts only near the surface or the bottom.
    """

    name: str
    parameters: dict[str, float]
    apply: Apply
    size: float
    number: int = 0
    spoils: tuple[int, ...] = ()
    needs: str = ""
    novel: bool = field(default=False)
