"""Contradictions of a recording with physics whose mend is likely: signs, axes, units and frames of its columns.

Coarse checks of a file that somebody maps for the first time, each with its evidence and its mend; `heading`,
`levelling` and `descent` measure finer ones. Both sides of a comparison are changes over windows, without their mean,
so that a sensor's bias and a steady drift do not matter.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bridge.vehicle.config import GRAVITY_M_S2
from identify.checks.scales import edge_means, integral, whole
from identify.dive import Array, Dive, Signal
from identify.ingest.rotation import (
    attitude_at,
    euler_angles,
    quaternions_from_euler,
    to_body,
    to_body_turn,
    to_earth,
)

WINDOW_S, EDGE_S = 0.5, 0.25
RISE_S = 2.0
"""Length of a window in which a vehicle that holds its depth rises by more than a depth sensor's noise."""

FEWEST_WINDOWS = 12

CLEAR, UNCLEAR, LEAST_BETTER = 0.7, 0.4, 0.2
"""Correlations from which two signals move alike, below which they don't, and by which one frame is better."""

LEAST_TURN_RAD, LEAST_RISE_M, LEAST_TILT_M_S2, LEAST_PUSH_M_S2 = 2e-3, 5e-3, 0.05, 0.02
"""Spread over windows below which noise may move a signal: of an angle, a depth, a tilt's share of gravity, an
acceleration."""

FLU = (1.0, -1.0, -1.0)
"""From forward, left, up, the axes of ROS, to forward, right, down."""

PASCALS_PER_METRE = 9900.0
"""Between fresh water and the sea."""

DEGREES = 180.0 / math.pi
NEAR_UNIT = 1.25
"""Factor within which a ratio is that of two units."""

FASTEST_M_S = 4.0

_MEANT = {
    "velocity": "the velocity",
    "gyro": "the gyro",
    "attitude": "the attitude",
    "specific_force": "the accelerometer",
    "depth": "the depth",
}
_AXES = "x", "y", "z"


@dataclass(frozen=True)
class Match:
    """How alike two signals move: correlation, and spread of the first over that of the second, with its sign."""

    correlation: float
    ratio: float

    @property
    def words(self) -> str:
        return f"correlation {self.correlation:.2f}, ratio {self.ratio:.3g}"


@dataclass(frozen=True)
class Mend:
    """A likely mend of a signal: its columns in `order` (empty for as they are), then times `factors`.

    signal: a field of Dive. factors: one per column; for the attitude, those of roll, pitch and yaw. problem: what is
    wrong, by which evidence, as a sentence without its end. remedy: what changes in the column map, likewise.
    """

    signal: str
    factors: tuple[float, ...]
    problem: str
    remedy: str
    order: tuple[int, ...] = ()

    @property
    def sentence(self) -> str:
        return f"{self.problem}; {self.remedy}."


def mends(dive: Dive) -> tuple[Mend, ...]:
    """The mends after which a recording contradicts physics no more, as far as these checks see; each in turn."""
    made: list[Mend] = []
    for check in (_gravity, _depth_below, _depth_by_pressure, _frames, _turns, _heave, _pushes):
        for mend in check(dive):
            dive = mended(dive, mend)
            made.append(mend)
    return tuple(made)


def mended(dive: Dive, mend: Mend) -> Dive:
    """The dive with a mend."""
    signal: Signal = getattr(dive, mend.signal)
    factors = np.array(mend.factors)
    if mend.signal == "attitude":
        angles = np.column_stack(euler_angles(signal.value)) * factors
        value = quaternions_from_euler(*angles.T)
    else:
        value = signal.value[:, list(mend.order)] if mend.order else signal.value
        value = value * factors
    changed: dict[str, Any] = {mend.signal: Signal(signal.time_s, value)}
    return replace(dive, **changed)


def _read(signal: Signal | None) -> Signal | None:
    """The finite readings of a signal, with zeros for axes that nothing read; None if fewer than two."""
    if signal is None:
        return None
    unread = ~np.isfinite(signal.value).any(axis=0)
    return whole(Signal(signal.time_s, np.where(unread, 0.0, signal.value)))


def matched(seen: Array, said: Array, least: float) -> Match | None:
    """How alike two series (n,) move; None if they are short, or if one moves less than `least`."""
    known = np.isfinite(seen) & np.isfinite(said)
    seen, said = seen[known], said[known]
    if len(seen) < FEWEST_WINDOWS or min(float(np.std(seen)), float(np.std(said))) == 0.0:
        return None
    if max(float(np.std(seen)), float(np.std(said))) < least:
        return None
    correlation = float(np.corrcoef(seen, said)[0, 1])
    return Match(correlation, math.copysign(float(np.std(seen) / np.std(said)), correlation))


def agreeing(dive: Dive) -> set[str]:
    """The signals that another signal bears out, in sign and unit."""
    named = {
        ("attitude", "gyro"): turn_match(dive),
        ("velocity", "depth"): _rise_match(dive),
        ("depth", "pressure"): _pressure_match(dive),
    }
    return {
        signal
        for pair, match in named.items()
        if match is not None and match.correlation > CLEAR and 1 / NEAR_UNIT < match.ratio < NEAR_UNIT
        for signal in pair
    }


def turn_match(dive: Dive) -> Match | None:
    """How alike attitude and gyro turn: the clearest correlation and its ratio over axes; None without both."""
    table = _turn_table(dive)
    clear = [match for row in table or () for match in row if match is not None]
    return max(clear, key=lambda match: abs(match.correlation), default=None)


def _gravity(dive: Dive) -> tuple[Mend, ...]:
    """Specific force whose size is gravity in another unit."""
    force = _read(dive.specific_force)
    if force is None:
        return ()
    usual = float(np.median(np.linalg.norm(force.value, axis=1)))
    for unit, factor in (("g", GRAVITY_M_S2), ("mg", GRAVITY_M_S2 / 1000), ("m/s2", 1 / GRAVITY_M_S2)):
        if GRAVITY_M_S2 / NEAR_UNIT < usual * factor < GRAVITY_M_S2 * NEAR_UNIT and not _is_gravity(usual):
            problem = f"The accelerometer usually reads {usual:.3g} m/s2, and at rest 9.8 is right: its unit is {unit}"
            return (_scaled("specific_force", (factor,) * 3, problem),)
    return ()


def _is_gravity(size: float) -> bool:
    return GRAVITY_M_S2 / NEAR_UNIT < size < GRAVITY_M_S2 * NEAR_UNIT


def _depth_below(dive: Dive) -> tuple[Mend, ...]:
    """Depths below zero."""
    depth = _read(dive.depth)
    if depth is None:
        return ()
    low, high = np.quantile(depth.value, (0.05, 0.95)).tolist()
    if not (np.median(depth.value) < 0 and -low > 3 * max(high, 0.0)):
        return ()
    problem = f"Most depths are below 0 (down to {low:.3g} m), so z points up"
    return (_scaled("depth", (-1.0,), problem),)


def _depth_by_pressure(dive: Dive) -> tuple[Mend, ...]:
    """Depth that changes as pressure does, by another unit."""
    match = _pressure_match(dive)
    if match is None or abs(match.correlation) < CLEAR:
        return ()
    factor = _unit_factor(match.ratio, (100.0, 1000.0, 0.01, 0.001, 1 / 0.3048, 0.3048))
    if factor is None and match.ratio > 0:
        return ()
    mend = (factor or 1.0) if match.ratio > 0 else -(factor or 1.0)
    problem = (
        f"Depth changes by {match.ratio:.3g} times what pressure comes to (correlation {match.correlation:.2f}), so "
        "its unit or sign is not as taken"
    )
    return (_scaled("depth", (mend,), problem),)


def _frames(dive: Dive) -> tuple[Mend, ...]:
    """Signals in axes forward, left, up, by gravity, by each other and by depth.

    Such a log agrees with itself, so only gravity and depth tell its frame; signals that nothing tells of are taken
    to be in the frame of the others if all of those agree.
    """
    frames: dict[str, bool] = {}
    proof: dict[str, str] = {}
    force, table = _read(dive.specific_force), _turn_table(dive)
    if force is not None and _is_gravity(abs(float(np.median(force.value[:, 2])))):
        up = float(np.median(force.value[:, 2]))
        frames["specific_force"] = up > 0
        proof["specific_force"] = f"the accelerometer's z shows {up:+.2f} m/s2, and {-abs(up):+.2f} is right"
    tilt = _tilt_match(dive)
    if "specific_force" in frames and tilt is not None and abs(tilt.correlation) > CLEAR:
        frames["attitude"] = tilt.correlation < 0
        proof["attitude"] = f"pitch against the accelerometer's x has {tilt.words}"
    fallen = _fallen(_half_turned(dive, "attitude") if frames.get("attitude") else dive)
    if fallen is not None:
        frames["velocity"], proof["velocity"] = fallen
    mirror = _mirror(table)
    if mirror is not None:
        is_mirrored, words = mirror
        by_force = frames.get("specific_force")
        if "attitude" in frames:
            frames["gyro"] = frames["attitude"] is not is_mirrored
            proof["gyro"] = words
        elif is_mirrored or (by_force is not None and frames.get("velocity", by_force) is by_force):
            # A gyro lies in the case of its accelerometer. Where gyro and attitude agree and the velocity is in another
            # frame than the accelerometer, nothing tells whose theirs is, and they are left alone.
            frames["gyro"] = bool(by_force)
            frames["attitude"] = frames["gyro"] is not is_mirrored
            proof["attitude"] = proof["gyro"] = words
    turned = {name for name, is_flu in frames.items() if is_flu}
    if turned and turned == set(frames):
        turned |= dive.signals().keys() & {"velocity", "gyro", "attitude", "specific_force"}
    return tuple(_turned(name, proof) for name in _MEANT if name in turned)


def _fallen(dive: Dive) -> tuple[bool, str] | None:
    """Whether depth follows the velocity as one in FLU, and the evidence; None if that is unclear."""
    matches = _rise_match(dive), _rise_match(_half_turned(dive, "velocity"))
    if matches[0] is None or matches[1] is None:
        return None
    as_it_is, as_flu = matches[0].correlation, matches[1].correlation
    best, other = max(as_it_is, as_flu), min(as_it_is, as_flu)
    if best < CLEAR or best - other < LEAST_BETTER:
        return None
    return as_flu > as_it_is, f"depth follows it with correlation {best:.2f}, and {other:.2f} otherwise"


def _half_turned(dive: Dive, name: str) -> Dive:
    """The dive with a signal turned between FLU and FRD; as it is without that signal."""
    return mended(dive, Mend(name, FLU, "", "")) if name in dive.signals() else dive


def _turned(name: str, proof: dict[str, str]) -> Mend:
    why = proof.get(name, f"so is {' and so is '.join(_MEANT[each] for each in proof)}")
    problem = f"{_MEANT[name].capitalize()} is in axes forward, left, up (FLU, as in ROS), not FRD: {why}"
    if name == "attitude":
        remedy = "multiply `scale` of `euler` by [1, -1, -1], of `quaternion` by [1, 1, -1, -1]"
        return Mend(name, FLU, problem, remedy)
    return _scaled(name, FLU, problem)


def _scaled(signal: str, factors: Sequence[float], problem: str, order: tuple[int, ...] = ()) -> Mend:
    """A mend whose remedy is an order of the columns and a scale."""
    steps = []
    if order:
        steps.append(f"give the columns of `{signal}` in the order {', '.join(str(k + 1) for k in order)}")
    if any(factor != 1.0 for factor in factors):
        listed = ", ".join(f"{factor:.5g}" for factor in factors)
        steps.append(f"multiply `scale` of `{signal}` by [{listed}]")
    return Mend(signal, tuple(factors), problem, " and ".join(steps), order)


def _turns(dive: Dive) -> tuple[Mend, ...]:
    """Gyro against the attitude's turning: swapped axes, signs, degrees."""
    table = _turn_table(dive)
    if table is None:
        return ()
    order = _order(table)
    matches = [table[axis][order[axis]] for axis in range(3)]
    clear = {axis: m for axis, m in enumerate(matches) if m is not None and abs(m.correlation) > CLEAR}
    factors = [1.0, 1.0, 1.0]
    for axis, match in clear.items():
        factors[axis] = math.copysign(1.0, match.ratio)
    ratios = [abs(match.ratio) for match in clear.values()]
    unit = _unit_factor(float(np.median(ratios)), (DEGREES, 1 / DEGREES)) if ratios else None
    # _unit_factor gives what mends the seen side; here the other side, the gyro, is mended.
    factors = [factor / (unit or 1.0) for factor in factors]
    if order == (0, 1, 2) and factors == [1.0, 1.0, 1.0]:
        return ()
    wrong = [
        *(["its axes are swapped"] if order != (0, 1, 2) else []),
        *(
            [f"its sign about {' and '.join(_AXES[a] for a in clear if factors[a] < 0)} is turned round"]
            if min(factors) < 0
            else []
        ),
        *(
            ["it is in degrees, or the attitude is" if unit and unit > 1 else "its unit is not as taken"]
            if unit
            else []
        ),
    ]
    evidence = "; ".join(f"{_AXES[axis]}: {match.words}" for axis, match in clear.items())
    problem = f"The gyro contradicts how the attitude turns ({evidence}): {' and '.join(wrong)}"
    return (_scaled("gyro", factors, problem, order if order != (0, 1, 2) else ()),)


def _heave(dive: Dive) -> tuple[Mend, ...]:
    """Depth against the downward velocity: sign and unit."""
    match = _rise_match(dive)
    if match is None or abs(match.correlation) < CLEAR:
        return ()
    unit = _unit_factor(abs(match.ratio), (100.0, 1000.0, 0.01, 0.001, 1 / 0.3048, 0.3048))
    if unit is None:
        return ()
    velocity = _read(dive.velocity)
    fast = velocity is not None and np.quantile(np.abs(velocity.value), 0.95) > FASTEST_M_S
    signal = "velocity" if fast and unit > 1 else "depth"
    factors = (1 / unit,) * 3 if signal == "velocity" else (unit,)
    problem = (
        f"Depth changes by {match.ratio:.3g} times what the downward velocity comes to (correlation "
        f"{match.correlation:.2f}), so the unit of {_MEANT[signal]} is not as taken"
    )
    return (_scaled(signal, factors, problem),)


def _pushes(dive: Dive) -> tuple[Mend, ...]:
    """The velocity's change along x and y against the accelerometer, less gravity and turning."""
    force, velocity = _read(dive.specific_force), _read(dive.velocity)
    gyro, attitude = _read(dive.gyro), _read(dive.attitude)
    if force is None or velocity is None or gyro is None or attitude is None:
        return ()
    edges_s = _edges((force, velocity, attitude))
    if edges_s is None:
        return ()
    middle_s = 0.5 * (edges_s[1:] + edges_s[:-1])
    gravity = to_body(attitude_at(attitude, middle_s), np.tile((0.0, 0.0, GRAVITY_M_S2), (len(middle_s), 1)))
    said = np.diff(
        np.column_stack([integral(force.time_s, force.value[:, k], edges_s) for k in range(3)]), axis=0
    )
    turning = np.cross(gyro.at(middle_s), velocity.at(middle_s))
    at_edges = edge_means(velocity.time_s, velocity.value, edges_s, EDGE_S)
    # The turning of an axis holds the other velocities alone, so it does not hide the sign of its own.
    moved = np.diff(at_edges, axis=0) / WINDOW_S
    push = said / WINDOW_S + gravity - turning
    found = [matched(moved[:, axis], push[:, axis], LEAST_PUSH_M_S2) for axis in (0, 1)]
    wrong = {axis: m for axis, m in enumerate(found) if m is not None and m.correlation < -CLEAR}
    if not wrong:
        return ()
    factors = tuple(-1.0 if axis in wrong else 1.0 for axis in range(3))
    evidence = "; ".join(f"{_AXES[axis]}: {match.words}" for axis, match in wrong.items())
    if set(wrong) == {1} and _fallen(dive) is None:
        # Axes forward, left, up are likelier than a mirror image, and nothing tells of z.
        return (_turned("velocity", {"velocity": f"it changes against the accelerometer ({evidence})"}),)
    problem = (
        f"The velocity changes against the accelerometer ({evidence}), so its sign along "
        f"{' and '.join(_AXES[axis] for axis in wrong)} is turned round"
    )
    return (_scaled("velocity", factors, problem),)


def _turn_table(dive: Dive) -> tuple[tuple[Match | None, ...], ...] | None:
    """By axis of the attitude's turning and by axis of the gyro, how alike they move over windows."""
    attitude, gyro = _read(dive.attitude), _read(dive.gyro)
    edges_s = _edges((attitude, gyro)) if attitude is not None and gyro is not None else None
    if attitude is None or gyro is None or edges_s is None:
        return None
    at_edges = attitude_at(attitude, edges_s)
    seen = to_body_turn(at_edges[:-1], at_edges[1:])
    said = np.diff(
        np.column_stack([integral(gyro.time_s, gyro.value[:, k], edges_s) for k in range(3)]), axis=0
    )
    return tuple(tuple(matched(seen[:, a], said[:, b], LEAST_TURN_RAD) for b in range(3)) for a in range(3))


def _mirror(table: tuple[tuple[Match | None, ...], ...] | None) -> tuple[bool, str] | None:
    """Whether pitch and yaw of the gyro have the other sign than the attitude's, and the evidence; None if unclear."""
    if table is None:
        return None
    clear = {k: m for k in range(3) if (m := table[k][k]) is not None and abs(m.correlation) > CLEAR}
    signs = {axis: match.correlation > 0 for axis, match in clear.items()}
    least = min((abs(match.correlation) for match in clear.values()), default=0.0)
    about = ", ".join(_AXES[axis] for axis in clear)
    if signs and all(signs.values()):
        return False, f"gyro and attitude turn alike about {about} (correlation {least:.2f} at least)"
    # Two axes at least: a single turned sign is no frame.
    if {1, 2} <= signs.keys() and not (signs[1] or signs[2]) and signs.get(0, True):
        return (
            True,
            f"gyro and attitude turn against each other about y and z (correlation -{least:.2f} at least)",
        )
    return None


def _order(table: tuple[tuple[Match | None, ...], ...]) -> tuple[int, int, int]:
    """Of the gyro, the columns that turn about x, y and z: swapped if two are plainly each other's."""

    def alike(axis: int, column: int) -> float:
        match = table[axis][column]
        return 0.0 if match is None else abs(match.correlation)

    for a, b in ((0, 1), (1, 2), (0, 2)):
        if min(alike(a, b), alike(b, a)) > CLEAR and max(alike(a, a), alike(b, b)) < UNCLEAR:
            swapped = [0, 1, 2]
            swapped[a], swapped[b] = b, a
            return swapped[0], swapped[1], swapped[2]
    return 0, 1, 2


def _tilt_match(dive: Dive) -> Match | None:
    """Gravity along x, by the accelerometer, against pitch; both as means over windows."""
    force, attitude = _read(dive.specific_force), _read(dive.attitude)
    edges_s = _edges((force, attitude)) if force is not None and attitude is not None else None
    if force is None or attitude is None or edges_s is None:
        return None
    said = np.diff(integral(force.time_s, force.value[:, 0], edges_s)) / WINDOW_S
    pitch = np.interp(0.5 * (edges_s[1:] + edges_s[:-1]), attitude.time_s, euler_angles(attitude.value)[1])
    return matched(said, GRAVITY_M_S2 * np.sin(pitch), LEAST_TILT_M_S2)


def _pressure_match(dive: Dive) -> Match | None:
    """Depth against pressure as a depth."""
    depth, pressure = _read(dive.depth), _read(dive.pressure)
    if depth is None or pressure is None:
        return None
    by_pressure = pressure.at(depth.time_s)[:, 0] / PASCALS_PER_METRE
    return matched(depth.value[:, 0], by_pressure, LEAST_RISE_M)


def _rise_match(dive: Dive) -> Match | None:
    """Change of depth over windows against the downward velocity, turned by the attitude if there is one."""
    depth, velocity, attitude = _read(dive.depth), _read(dive.velocity), _read(dive.attitude)
    if depth is None and dive.pressure is not None:
        depth = _read(Signal(dive.pressure.time_s, dive.pressure.value / PASCALS_PER_METRE))
    if depth is None or velocity is None:
        return None
    edges_s = _edges((depth, velocity), RISE_S)
    if edges_s is None:
        return None
    down = velocity.value[:, 2]
    if attitude is not None:
        down = to_earth(attitude_at(attitude, velocity.time_s), velocity.value)[:, 2]
    fallen = np.diff(edge_means(depth.time_s, depth.value, edges_s, EDGE_S)[:, 0])
    return matched(fallen, np.diff(integral(velocity.time_s, down, edges_s)), LEAST_RISE_M)


def _edges(signals: tuple[Signal, ...], longest_s: float = WINDOW_S) -> Array | None:
    """Edges of windows over the time that all signals have, each up to `longest_s`; None if that is short."""
    start_s = max(float(signal.time_s[0]) for signal in signals)
    end_s = min(float(signal.time_s[-1]) for signal in signals)
    if end_s - start_s < FEWEST_WINDOWS * WINDOW_S:
        return None
    window_s = float(np.clip((end_s - start_s) / FEWEST_WINDOWS, WINDOW_S, longest_s))
    # A little more, so that the end of a whole number of windows is none short of it.
    count = int((end_s - start_s) / window_s + 1e-9)
    return start_s + window_s * np.arange(count + 1, dtype=np.float64)


def _unit_factor(ratio: float, ratios: tuple[float, ...]) -> float | None:
    """What the seen side must be multiplied by if its ratio is that of two units; None if it is of none."""
    for unit in ratios:
        if unit / NEAR_UNIT < abs(ratio) < unit * NEAR_UNIT:
            return 1.0 / unit
    return None
