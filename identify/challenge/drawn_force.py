"""A force of no effect's form, by what a vehicle does and when: compiled, for any dive. `bench/unknown` draws them."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

VELOCITY, ACCELERATION, THRUST, ATTITUDE, DEPTH, PULSE, NOTHING = 0, 6, 12, 18, 21, 22, -1
"""Where the signals of each sort begin: of the six degrees of freedom, twice roll, pitch and the sine of heading, and
a thruster each."""

INSTANT, LAG, DELAY, LEAK, PLAY = 0, 1, 2, 3, 4
"""What a force remembers."""


class DrawnForce(NamedTuple):
    """A wrench `size` (6,), N and N m, times a shape: the product of two factors, each a signal less its `middle`, over
    its `scale`, to a `power`, odd or even in it; with a memory; times `when` (steps + 1,) or (1,).

    signal (2,): places as above, NOTHING for a factor of one. even (2,): 1 where a factor has no sign. memory: of the
    product; memory_s: lag, delay, or what an integral leaks in; play: the half-width of hysteresis.
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
    """Nothing."""
    return DrawnForce(
        np.zeros(6), np.full(2, NOTHING), np.zeros(2), np.ones(2), np.ones(2), np.zeros(2, np.int64), np.ones(1)
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def signal_of(place: int, state: Array, nu_dot: Array, thrust: Array, pulse: Array) -> float:
    """One signal of a vehicle: state as `world.rates` has it, its rate of velocity (6,), the wrench of its thrusters
    (6,), and what each is asked for (k,)."""
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
    """The product of the factors at an instant."""
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
    """What the memory makes of the product at a step; `past` (n,): the last n products, or the one state kept."""
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
    """What a memory holds before a dive."""
    late = max(round(force.memory_s / step_s), 1) if force.memory == DELAY else 1
    return np.zeros(late)
