"""Contradictions of a recording with physics whose mend is likely: signs, axes, units and frames of its columns.

Coarse checks of a file that somebody maps for the first time, each with its evidence and its mend; `heading`,
`levelling` and `descent` measure finer ones. Both sides of a comparison are changes over windows, without their mean,
so that a sensor's bias and a steady drift do not matter.
"""

import math

import numpy as np

from bridge.vehicle.config import GRAVITY_M_S2
from identify.checks.mapping.frames import earth_mends, speed_mends, wrench_mends
from identify.checks.mapping.mend import FLU, Mend, column_mend, mended
from identify.checks.sensors.sensor_pairs import (
    CLEAR,
    NEAR_UNIT,
    NEARER_UNIT,
    PASCALS_PER_METRE,
    UNCLEAR,
    Match,
    pressure_match,
    pushes_of,
    readings,
    rise_match,
    tilt_match,
    turn_table,
    unit_factor,
)
from identify.dive import Dive
from identify.ingest.mapping.ranges import STEADY
from identify.ingest.mapping.units import AIR_PA, FOOT_M, INCH_M, UNITS
from identify.words import listed

LEAST_BETTER = 0.2
"""Least advantage in correlation of the better of two frames."""

DEGREES = 180.0 / math.pi
TURNS = {
    theirs / ours: "it is in degrees, or the attitude is"
    if (unit, taken) == ("deg/s", "rad/s")
    else f"it is in {unit}, taken for {taken}"
    for taken, ours in UNITS["gyro"].items()
    for unit, theirs in UNITS["gyro"].items()
    if unit != taken
}
"""Factors from a rate of turn in a wrong unit to the right, and what is wrong."""
LENGTHS = {
    100.0: "centimetres", 1000.0: "millimetres", 1 / FOOT_M: "feet", 1 / INCH_M: "inches", 0.01: "", 0.001: "",
    FOOT_M: "",
}  # fmt: skip
"""Ratios of a depth to its metres that are of a unit, and the unit of the column, if it is the depth's."""

PRESSURES = {
    theirs / ours: f"{unit} taken for {taken}"
    for taken, ours in reversed(UNITS["pressure"].items())
    for unit, theirs in reversed(UNITS["pressure"].items())
    if theirs != ours and "mbar" not in (unit, taken)
}
"""Factors from a pressure in a wrong unit to the right, and an example of such units."""

FITS_AIR = 0.5
"""Part of the air's pressure within which depth and pressure agree in the absolute."""

SHALLOW = 1.0
"""A position whose least depth is less than this part of how far it goes began near the surface."""
LARGEST_OFFSET_M = 1.0
"""Where no motion tells, a position that is always deeper than any sensor is mounted is a depth."""

LEAST_MOVED = 0.1
"""A velocity that changes by less than this part of what the accelerometer says is none whose sign that tells."""
FASTEST_DIVE_M_S, PACE_S = 5.0, 1.0
"""A vehicle that sinks or rises, over PACE_S, for a twentieth of a recording faster than this is none."""

_MEANT = {
    "velocity": "the velocity",
    "gyro": "the gyro",
    "attitude": "the attitude",
    "specific_force": "the accelerometer",
    "depth": "the depth",
}
_AXES = "x", "y", "z"


def mends(dive: Dive, *, depth_is_a_position: bool = False) -> tuple[Mend, ...]:
    """The mends after which a recording contradicts physics no more, as far as these checks see; each in turn.

    depth_is_a_position: whether it counts from elsewhere than the surface, perhaps.
    """
    made: list[Mend] = []
    below = _position_below if depth_is_a_position else _depth_below
    checks = (
        _gravity, below, _pressure_by_pace, _pressure_by_depth, _depth_by_pressure, _quaternion_order, _turned_force,
        _frames, _angles, _turns, earth_mends, speed_mends, _heave, _pushes, wrench_mends,
    )  # fmt: skip
    for check in checks:
        for mend in check(dive):
            dive = mended(dive, mend)
            made.append(mend)
    return tuple(made)


def _gravity(dive: Dive) -> tuple[Mend, ...]:
    """Specific force whose size is gravity in another unit."""
    force = readings(dive.specific_force)
    if force is None:
        return ()
    usual = float(np.median(np.linalg.norm(force.value, axis=1)))
    if np.linalg.norm(np.median(force.value, axis=0)) < STEADY * usual:
        return ()
    for unit, factor in (("g", GRAVITY_M_S2), ("mg", GRAVITY_M_S2 / 1000), ("m/s2", 1 / GRAVITY_M_S2)):
        if _is_gravity(usual * factor) and not _is_gravity(usual):
            problem = f"The accelerometer usually reads {usual:.3g} m/s2, and at rest 9.8 is right: its unit is {unit}"
            return (column_mend("specific_force", (factor,) * 3, problem),)
    return ()


def _is_gravity(size: float) -> bool:
    return GRAVITY_M_S2 / NEAR_UNIT < size < GRAVITY_M_S2 * NEAR_UNIT


def _depth_below(dive: Dive) -> tuple[Mend, ...]:
    depth = readings(dive.depth)
    if depth is None:
        return ()
    low, high = np.quantile(depth.value, (0.05, 0.95)).tolist()
    if not (np.median(depth.value) < 0 and -low > 3 * max(high, 0.0)):
        return ()
    problem = f"Most depths are below 0 (down to {low:.3g} m), so z points up"
    return (column_mend("depth", (-1.0,), problem),)


def _position_below(dive: Dive) -> tuple[Mend, ...]:
    """A position whose z points up, by the motion; by where it is only if it went there or is far from 0: it
    may count from a sensor's own place."""
    depth, match = readings(dive.depth), pressure_match(dive)
    if depth is None or (match is not None and abs(match.correlation) > CLEAR):
        return ()
    turned = mended(dive, Mend("depth", (-1.0,)))
    as_it_is, as_height = map(_goes_with_depth_and_push, (dive, turned))
    best, other = max(as_it_is, as_height), min(as_it_is, as_height)
    if best > CLEAR and other < UNCLEAR:
        problem = (
            f"A velocity that goes with the accelerometer goes with the position too by {as_height:.2f} if that counts "
            f"up, and by {as_it_is:.2f} if it counts down, so z points up"
        )
        return (column_mend("depth", (-1.0,), problem),) if as_height > as_it_is else ()
    low, high = np.quantile(depth.value, (0.05, 0.95)).tolist()
    return _depth_below(dive) if high > -SHALLOW * (high - low) or high < -LARGEST_OFFSET_M else ()


def _goes_with_depth_and_push(dive: Dive) -> float:
    """The least correlation of the velocity, in the axes that it then has, with the accelerometer and with the depth;
    0 if unclear."""
    for mend in _frames(dive):
        dive = mended(dive, mend)
    pushes = pushes_of(dive)
    known = [*(pushes.by_sign() if pushes else (None,)), rise_match(dive)]
    return min(0.0 if match is None else match.correlation for match in known)


def _depth_by_pressure(dive: Dive) -> tuple[Mend, ...]:
    """Depth that changes as pressure does, by another unit."""
    match = pressure_match(dive)
    if match is None or abs(match.correlation) < CLEAR:
        return ()
    factor = unit_factor(match.ratio, tuple(LENGTHS))
    if factor is None and match.ratio > 0:
        return ()
    mend = (factor or 1.0) if match.ratio > 0 else -(factor or 1.0)
    problem = (
        f"Depth changes by {match.ratio:.3g} times what pressure comes to (correlation {match.correlation:.2f}), so "
        f"{_unit_words('its unit or sign is not as taken', factor)}"
    )
    return (column_mend("depth", (mend,), problem),)


def _pressure_by_depth(dive: Dive) -> tuple[Mend, ...]:
    """Pressure in another unit, or from the surface, as depth tells by its changes and in the absolute."""
    match, depth, pressure = pressure_match(dive), readings(dive.depth), readings(dive.pressure)
    if match is None or match.correlation < CLEAR or depth is None or pressure is None:
        return ()
    deep_m, over_pa = float(np.median(depth.value)), float(np.median(pressure.at(depth.time_s)))
    as_it_is = over_pa - PASCALS_PER_METRE * deep_m / match.ratio
    fits = abs(as_it_is - AIR_PA) < FITS_AIR * AIR_PA
    if fits and unit_factor(match.ratio, (1.0, *LENGTHS)) is not None:
        return ()
    # In a unit ten times as large, an absolute pressure looks as if it counted from the surface, and gets the air's.
    added = AIR_PA if fits else 0.0
    changes = f"Depth changes by {match.ratio:.3g} times what pressure comes to"
    for factor, unit in {1.0: "", **PRESSURES}.items():
        if not factor / NEARER_UNIT < match.ratio < factor * NEARER_UNIT:
            continue
        in_unit = f", as {unit}" if unit else ""
        at_surface = factor * (over_pa - added) - PASCALS_PER_METRE * deep_m
        if unit and abs(at_surface - AIR_PA) < FITS_AIR * AIR_PA:
            return (column_mend("pressure", (factor,), f"{changes}{in_unit}", offset=-factor * added),)
        if not fits and abs(at_surface) < FITS_AIR * AIR_PA:
            problem = f"{changes}{in_unit}, and it is 0 at the surface: it counts from the surface"
            return (column_mend("pressure", (factor,), problem, offset=AIR_PA),)
    return ()


def _pressure_by_pace(dive: Dive) -> tuple[Mend, ...]:
    """A pressure of pascals from the surface that was taken for hectopascals, which would sink a vehicle at 20 m/s."""
    pressure = readings(dive.pressure)
    if pressure is None:
        return ()
    paces_s = np.arange(pressure.time_s[0], pressure.time_s[-1], PACE_S)
    sunk_m = np.diff(pressure.at(paces_s)[:, 0]) / PASCALS_PER_METRE
    if not len(sunk_m):
        return ()
    fastest = float(np.quantile(np.abs(sunk_m), 0.95)) / PACE_S
    in_pascals = UNITS["pressure"]["Pa"] / UNITS["pressure"]["hPa"]
    if fastest < FASTEST_DIVE_M_S or fastest * in_pascals > FASTEST_DIVE_M_S:
        return ()
    problem = (
        f"By it the vehicle sinks or rises at {fastest:.3g} m/s, which none does: it is in Pa, taken for hPa, and "
        "counts from the surface"
    )
    return (column_mend("pressure", (in_pascals,), problem, offset=AIR_PA),)


def _unit_words(otherwise: str, factor: float | None) -> str:
    """The unit of a depth by its factor; `otherwise` if no known unit has that factor."""
    for ratio, unit in LENGTHS.items():
        if factor and unit and math.isclose(1 / factor, ratio):
            return f"it is in {unit}"
    return otherwise


def _frames(dive: Dive) -> tuple[Mend, ...]:
    """Signals in axes forward, left, up, by gravity, by each other and by depth.

    Such a log agrees with itself, so only gravity and depth tell its frame; signals that nothing tells of are taken
    to be in the frame of the others if all of those agree.
    """
    frames: dict[str, bool] = {}
    proof: dict[str, str] = {}
    force, table = readings(dive.specific_force), turn_table(dive)
    if force is not None and _is_gravity(abs(float(np.median(force.value[:, 2])))):
        up = float(np.median(force.value[:, 2]))
        frames["specific_force"] = up > 0
        proof["specific_force"] = f"the accelerometer's z shows {up:+.2f} m/s2, and {-abs(up):+.2f} is right"
    tilt = tilt_match(dive)
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


def _turned_force(dive: Dive) -> tuple[Mend, ...]:
    """Gravity and the acceleration against it, in place of specific force: all three axes are turned round.

    By gravity and the attitude alone, that looks like axes forward, left, up; the velocity's change tells the two
    apart.
    """
    force = readings(dive.specific_force)
    if force is None or float(np.median(force.value[:, 2])) < 0:
        return ()
    turned = mended(dive, Mend("specific_force", (-1.0,) * 3))
    pushes, tilt = pushes_of(turned), tilt_match(turned)
    known = [match for match in (tilt, *(pushes.by_sign() if pushes else ())) if match is not None]
    if len(known) < 3 or min(match.correlation for match in known) < CLEAR:
        return ()
    least = min(match.correlation for match in known)
    problem = (
        f"The accelerometer's z shows {np.median(force.value[:, 2]):+.2f} m/s2, and turned round all three axes go "
        f"with pitch and with the velocity's change (correlation {least:.2f} at least): it reads gravity, not what "
        "holds against it"
    )
    return (column_mend("specific_force", (-1.0,) * 3, problem),)


def _fallen(dive: Dive) -> tuple[bool, str] | None:
    """Whether depth follows the velocity as one in FLU, and the evidence; None if that is unclear."""
    matches = rise_match(dive), rise_match(_half_turned(dive, "velocity"))
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
    others = [_MEANT[each] for each in proof]
    why = proof.get(name, f"so {'is' if len(others) == 1 else 'are'} {listed(others)}")
    problem = f"{_MEANT[name].capitalize()} is in axes forward, left, up (FLU, as in ROS), not FRD: {why}"
    if name == "attitude":
        remedy = "multiply `scale` of `euler` by [1, -1, -1], of `quaternion` by [1, 1, -1, -1]"
        return Mend(name, FLU, problem, remedy)
    return column_mend(name, FLU, problem)


def _angles(dive: Dive) -> tuple[Mend, ...]:
    """Roll and pitch in radians with a heading in degrees, by the gyro."""
    table = turn_table(dive)
    matches = [table[axis][axis] for axis in range(3)] if table else []
    clear = [match for match in matches if match is not None and abs(match.correlation) > CLEAR]
    units = [unit_factor(match.ratio, (1 / DEGREES, 1.0)) for match in clear]
    if len(clear) < 3 or units != [DEGREES, DEGREES, 1.0]:
        return ()
    evidence = "; ".join(f"{axis}: {match.words}" for axis, match in zip(_AXES, clear, strict=True))
    factors = (DEGREES, DEGREES, 1.0)
    remedy = f"multiply `scale` of `euler` by [{DEGREES:.5g}, {DEGREES:.5g}, 1]"
    problem = f"The attitude turns as the gyro says about z alone ({evidence}): roll and pitch are in radians"
    return (Mend("attitude", factors, problem, remedy),)


def _quaternion_order(dive: Dive) -> tuple[Mend, ...]:
    """A quaternion whose real part stands last where it was taken to be first, by the gyro."""
    if dive.attitude is None or _turns_alike(dive):
        return ()
    order = (3, 0, 1, 2)
    problem = (
        "The gyro contradicts how the attitude turns, and agrees with it if the quaternion's real part is the last "
        "of its columns"
    )
    remedy = "begin `columns` of `quaternion` with its last column"
    mend = Mend("attitude", (1.0, 1.0, 1.0), problem, remedy, order)
    return (mend,) if _turns_alike(mended(dive, mend)) else ()


def _turns_alike(dive: Dive) -> bool:
    """Whether gyro and attitude turn alike about two axes at least, and about none otherwise."""
    table = turn_table(dive)
    matches = [match for axis in range(3) if (match := table[axis][axis]) is not None] if table else []
    alike = [m for m in matches if m.correlation > CLEAR and 1 / NEAR_UNIT < m.ratio < NEAR_UNIT]
    return len(alike) >= 2 and len(alike) == len(matches)


def _turns(dive: Dive) -> tuple[Mend, ...]:
    """Gyro against the attitude's turning: swapped axes, signs, units."""
    table = turn_table(dive)
    if table is None:
        return ()
    order = _order(table)
    matches = [table[axis][order[axis]] for axis in range(3)]
    clear = {axis: m for axis, m in enumerate(matches) if m is not None and abs(m.correlation) > CLEAR}
    factors = [1.0, 1.0, 1.0]
    for axis, match in clear.items():
        factors[axis] = math.copysign(1.0, match.ratio)
    ratio = float(np.median([abs(match.ratio) for match in clear.values()])) if clear else 1.0
    unit = next((each for each in TURNS if each / NEAR_UNIT < ratio < each * NEAR_UNIT), 1.0)
    factors = [factor * unit for factor in factors]
    if order == (0, 1, 2) and factors == [1.0, 1.0, 1.0]:
        return ()
    wrong = [
        *(["its axes are swapped"] if order != (0, 1, 2) else []),
        *(
            [f"its sign about {' and '.join(_AXES[a] for a in clear if factors[a] < 0)} is turned round"]
            if min(factors) < 0
            else []
        ),
        *([TURNS[unit]] if unit in TURNS else []),
    ]
    evidence = "; ".join(f"{_AXES[axis]}: {match.words}" for axis, match in clear.items())
    problem = f"The gyro contradicts how the attitude turns ({evidence}): {' and '.join(wrong)}"
    return (column_mend("gyro", factors, problem, order if order != (0, 1, 2) else ()),)


def _heave(dive: Dive) -> tuple[Mend, ...]:
    """Depth against the downward velocity: the unit of either."""
    match = rise_match(dive)
    if match is None or abs(match.correlation) < CLEAR:
        return ()
    unit = unit_factor(abs(match.ratio), tuple(LENGTHS))
    if unit is None:
        return ()
    by_pressure = pressure_match(dive)
    is_borne_out = dive.depth is None or (
        by_pressure is not None and 1 / NEAR_UNIT < by_pressure.ratio < NEAR_UNIT
    )
    # No unit of a depth is longer than a metre.
    signal = "velocity" if is_borne_out or unit > 1 else "depth"
    factors = (1 / unit,) * 3 if signal == "velocity" else (unit,)
    words = f"the unit of {_MEANT[signal]} is not as taken"
    if signal == "depth":
        words = _unit_words(words, unit)
    elif math.isclose(unit, 1 / FOOT_M):
        words = "the velocity is in ft/s"
    problem = (
        f"Depth changes by {match.ratio:.3g} times what the downward velocity comes to (correlation "
        f"{match.correlation:.2f}), so {words}"
    )
    return (column_mend(signal, factors, problem),)


def _pushes(dive: Dive) -> tuple[Mend, ...]:
    """The velocity's change along x and y against the accelerometer: its signs."""
    pushes = pushes_of(dive)
    compared = pushes.by_sign() if pushes else ()
    moving = {axis: m for axis, m in enumerate(compared) if m is not None and abs(m.ratio) > LEAST_MOVED}
    wrong = {axis: m for axis, m in moving.items() if m.correlation < -CLEAR}
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
    return (column_mend("velocity", factors, problem),)


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
