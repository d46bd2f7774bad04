"""Effects planted on the hull and around it, in forms that the library of effects does not use; compiled."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Hull(NamedTuple):
    """Parameters of the effects at the hull, SI units; all zero hides nothing.

    drag (6,): N s^n/m^n in -drag |nu|^drag_power sign(nu). asymmetry: additional linear surge drag astern; astern:
    share by which `drag` is larger astern. lift_y, lift_n: coefficients of -lift |u| v, which stalls at large drift
    according to `stall`. y_r, n_v: coupled damping. munk: additional Munk moment, as a share. grip, slack_m,
    anchor_n, anchor_e: a tether's stiffness near its anchor, the distance at which the stiffness doubles, and the
    anchor; rise: upward pull as a share of the horizontal pull. buoyancy_n, squeeze: additional buoyancy, falling
    with depth. surface, surface_m, bottom, bottom_m, floor_m: added mass near a boundary, on the degrees of freedom
    of near_share (6,). wave_number, wave_ref: how waves fade below a depth. shed_n, shed_k: side force by speed
    squared, and radians of its phase per metre. swirl: drag by turn rate and depth. trail_n: force with a memory of
    the speed (wake). chain_n, chain_m: friction of a chain that drags on the bottom, and the altitude below which it
    acts.
    """

    drag: Array
    near_share: Array
    drag_power: float = 1.8
    asymmetry: float = 0.0
    lift_y: float = 0.0
    lift_n: float = 0.0
    y_r: float = 0.0
    n_v: float = 0.0
    munk: float = 0.0
    munk_yaw_kg: float = 0.0
    munk_pitch_kg: float = 0.0
    grip: float = 0.0
    slack_m: float = 5.0
    anchor_n: float = 0.0
    anchor_e: float = 0.0
    buoyancy_n: float = 0.0
    squeeze: float = 0.0
    surface: float = 0.0
    surface_m: float = 0.5
    bottom: float = 0.0
    bottom_m: float = 0.5
    floor_m: float = 100.0
    wave_number: float = 0.0
    wave_ref: float = 0.0
    shed_n: float = 0.0
    shed_k: float = 0.0
    swirl: float = 0.0
    trail_n: float = 0.0
    chain_n: float = 0.0
    chain_m: float = 0.0
    astern: float = 0.0
    stall: float = 0.15
    rise: float = 0.15


def bare_hull(floor_m: float) -> Hull:
    """A hull that hides nothing, above a bottom at depth `floor_m`."""
    return Hull(np.zeros(6), np.array([0.3, 1.0, 1.0, 0.0, 0.0, 0.0]), floor_m=floor_m)


@njit(cache=True, error_model="numpy")
def growth(depth: float, hull: Hull) -> tuple[float, float]:
    """Share by which added masses grow near the surface and the bottom, and its change per metre of depth.

    The share falls exponentially below the surface, and with the cube of the altitude above the bottom.
    """
    more, by_metre = 0.0, 0.0
    if hull.surface != 0.0:
        near = hull.surface * np.exp(-max(depth, 0.0) / hull.surface_m)
        more += near
        if depth > 0.0:
            by_metre -= near / hull.surface_m
    if hull.bottom != 0.0:
        far = max(hull.floor_m - depth, 0.0) / hull.bottom_m
        fall = 1.0 + far**3
        more += hull.bottom / fall
        by_metre += hull.bottom * 3.0 * far * far / (hull.bottom_m * fall * fall)
    return more, by_metre


@njit(cache=True, error_model="numpy")
def hull_wrench(
    state: Array, through: Array, hull: Hull, phase: float, wake: float, out: Array
) -> tuple[float, float, float]:
    """Add the wrench of the planted effects to `out` (6,); return the tether's pull (north, east, down).

    `through` (6,) is the velocity through the water, `phase` that of shed vortices, `wake` the remembered surge
    speed.
    """
    u, v, w, r = through[0], through[1], through[2], through[5]
    for i in range(6):
        if hull.drag[i] != 0.0:
            out[i] -= hull.drag[i] * np.abs(through[i]) ** hull.drag_power * np.sign(through[i])
    if hull.asymmetry != 0.0:
        out[0] -= hull.asymmetry * u * 0.5 * (1.0 - np.tanh(u / 0.04))
    if hull.astern != 0.0:
        more = hull.astern * hull.drag[0] * np.abs(u) ** hull.drag_power * np.sign(u)
        out[0] -= more * 0.5 * (1.0 - np.tanh(u / 0.04))
    if hull.lift_y != 0.0 or hull.lift_n != 0.0:
        drift = np.abs(v) / (np.abs(u) + 0.02)
        lift = np.abs(u) * v / (1.0 + hull.stall * drift * drift)
        out[1] -= hull.lift_y * lift
        out[5] -= hull.lift_n * lift
    if hull.y_r != 0.0 or hull.n_v != 0.0:
        out[1] -= hull.y_r * r * (1.0 + 0.4 * np.abs(r))
        out[5] -= hull.n_v * v * (1.0 + 0.6 * np.abs(v))
    if hull.munk != 0.0:
        stall = 1.0 / (1.0 + 0.5 * (v * v + w * w))
        out[5] -= hull.munk * hull.munk_yaw_kg * u * v * stall
        out[4] -= hull.munk * hull.munk_pitch_kg * u * w * stall
    if hull.shed_n != 0.0:
        out[1] += hull.shed_n * u * np.abs(u) * np.sin(phase)
    if hull.swirl != 0.0:
        out[0] -= hull.swirl * r * state[2]
        out[1] -= 0.6 * hull.swirl * r * np.abs(r) * state[2]
    if hull.trail_n != 0.0:
        out[0] += hull.trail_n * np.tanh((wake - u) / 0.15) * np.abs(wake)
    if hull.chain_n != 0.0 and hull.floor_m - state[2] < hull.chain_m:
        speed = np.sqrt(u * u + v * v) + 0.01
        out[0] -= hull.chain_n * u / speed
        out[1] -= hull.chain_n * v / speed
    if hull.grip == 0.0:
        return 0.0, 0.0, 0.0
    north, east = state[0] - hull.anchor_n, state[1] - hull.anchor_e
    far = np.sqrt(north * north + east * east)
    pull = hull.grip * (1.0 + (far / hull.slack_m) ** 2)
    return -pull * north, -pull * east, -hull.rise * pull * far
