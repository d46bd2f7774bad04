"""Units guessed from the range of values, where a name gives none."""

import math
from dataclasses import dataclass

import numpy as np

from bridge.arrays import Array
from bridge.clock import OLDEST_UNIX_S
from bridge.vehicle.config import GRAVITY_M_S2
from identify.checks.readings.impossible import LONGEST_DIVE_S
from identify.ingest.mapping.column_map import TIME_UNITS
from identify.ingest.mapping.units import AIR_PA, UNITS

PRESSURES = UNITS["pressure"]

LARGEST_ANGLE_RAD = 7.0
"""Headings end at 2 pi."""

TO_A_TURN, ROUNDED = 0.05, 0.005
"""A heading that goes all round ends within this of pi, or of 2 pi; by rounding, so much beyond it."""

LEAST_TILT_DEG = 0.35
"""In degrees, no vehicle's roll and pitch stay within less; in radians, those of most do."""

LARGEST_TURN_RAD_S, LARGEST_SPEED_M_S = 12.0, 20.0
"""No underwater vehicle turns or travels faster."""

FAR_BEYOND, FEWEST_SIZES = 5.0, 100
"""Factor by which a mark for no reading is beyond all readings, and the least different sizes of these."""

LEAST_PULSE_US = 700.0
LEAST_AIR_PA, DEEPEST_PA = 70_000.0, 6e6
"""Of air above the highest lakes that are dived, and of 600 m of water."""
DEEP = 1.3
"""Of a log whose least absolute pressure is larger by this factor than the air's, nothing was read near the surface."""
LEAST_MILLIVOLTS = 1000.0
FEWEST_OF_A_CLOCK = 10
"""Least number of rows of which a battery that is never lower than just before is a clock."""
NEAR = 1.3
"""Factor within which the norm of specific force is that of gravity."""

STEADY = 0.5
"""A vehicle is mostly upright: with gravity in it, an accelerometer's usual reading has more of its usual size."""

GRAVITIES = tuple(
    (unit, GRAVITY_M_S2 / UNITS["specific_force"][unit]) for unit in ("m/s2", "ft/s2", "g", "mg")
)
"""Units of a specific force, and gravity in them."""

SPINS_RAD_S = 0.4
"""A vehicle that turns faster for nine tenths of a recording spins; few do."""

LATEST_UNIX_S = 4.1e9
"""Of the year 2100. A larger time since 1970 is of a smaller unit, or since the start of a computer."""

MIDDLE_US = 1500.0
"""Pulse of most thrusters at rest."""


@dataclass(frozen=True)
class Guess:
    """The unit that a column's values fit, with offset and scale in the file's unit.

    is_telling: whether only that unit fits. unit: empty where values fit no unit. reason: a sentence.
    """

    unit: str
    reason: str
    is_telling: bool = True
    offset: float = 0.0
    scale: float = 1.0


def unit_of(signal: str, values: Array) -> Guess:
    """The likeliest unit of a signal by its values (n, columns), NaN where unknown."""
    known = values[np.isfinite(values)]
    if signal == "velocity":
        known = _without_marks(known)
    largest = float(np.quantile(np.abs(known), 0.999)) if len(known) else 0.0
    match signal:
        case "euler" if largest > LARGEST_ANGLE_RAD and _is_unwrapped(values):
            return Guess(
                "rad", "Roll and pitch are too small for degrees: radians, with turns counted on.", False
            )
        case "euler" if largest > LARGEST_ANGLE_RAD:
            return Guess("deg", f"Angles reach {largest:.3g}, so they are degrees.")
        case "euler":
            return Guess(
                "rad",
                f"Angles stay within {largest:.2g}: taken for radians.",
                any(turn - TO_A_TURN < largest < turn + ROUNDED for turn in (math.pi, 2 * math.pi)),
            )
        case "gyro" | "fog" if largest > LARGEST_TURN_RAD_S:
            return Guess("deg/s", f"Rates of turn reach {largest:.3g}, so they are degrees a second.")
        case "gyro" | "fog":
            taken = f"Rates of turn stay within {largest:.2g}: taken for radians a second."
            # The three of an attitude may be called angular; nobody calls a heading a fibre-optic gyro.
            angle = _as_an_angle(values) if values.shape[1] == 3 else ""
            return Guess("rad/s", f"{taken}{angle}", False)
        case "velocity" if largest > LARGEST_SPEED_M_S:
            unit = "cm/s" if largest < 100 * LARGEST_SPEED_M_S / 4 else "mm/s"
            return Guess(unit, f"Velocities reach {largest:.3g}, so they are taken for {unit}.", False)
        case "velocity":
            return Guess("m/s", f"Velocities stay within {largest:.2g}: taken for m/s.", False)
        case "specific_force":
            return _force(values)
        case "pressure":
            return _pressure(known)
        case "voltage" if len(known) >= FEWEST_OF_A_CLOCK and (np.diff(known) > 0).all():
            return Guess("", "It rises from each row to the next, as a clock does.")
        case "voltage" if len(known) and np.median(known) > LEAST_MILLIVOLTS:
            return Guess("mV", f"The voltage is about {np.median(known):.0f}, so it is in millivolts.")
        case "pwm":
            return _command(known)
        case "depth" | "altitude":
            return Guess("m", f"{signal.capitalize()} is taken for metres.", False)
        case "rpm":
            return Guess("rpm", "Speeds of the thrusters are taken for rpm.", False)
    return Guess(
        {"voltage": "V", "tau_cmd": "N"}.get(signal, "1"), "", signal in ("quaternion", "armed", "voltage")
    )


def _without_marks(known: Array) -> Array:
    """Values without those by which a sensor says that it read nothing: of one size, and FAR_BEYOND all others."""
    sizes, counts = np.unique(np.abs(known), return_counts=True)
    is_mark = len(sizes) > FEWEST_SIZES and counts[-1] > 1 and sizes[-1] > FAR_BEYOND * sizes[-2]
    return known[np.abs(known) < sizes[-1]] if is_mark else known


def time_unit_of(time: Array) -> tuple[str, bool]:
    """Unit of a time column (n,) in rising order by its size or steps, and whether only that unit fits.

    A size is that of a date only if the rows then make a dive: a simulator's clock of nanoseconds has that size, too.
    """
    known = time[np.isfinite(time)]
    usual_span = float(np.diff(np.quantile(known, (0.1, 0.9)))[0]) if len(known) else 0.0
    for unit, size_s in TIME_UNITS.items():
        is_date = len(known) and OLDEST_UNIX_S <= known[0] * size_s < LATEST_UNIX_S
        if is_date and usual_span * size_s <= LONGEST_DIVE_S:
            return unit, True
    steps = np.diff(known)
    step = float(np.median(steps[steps > 0])) if np.any(steps > 0) else 0.0
    for least, unit in ((1e6, "ns"), (1e3, "us"), (5.0, "ms")):
        if step >= least:
            return unit, True
    return "s", step < 1.0


def _as_an_angle(rates: Array) -> str:
    """A sentence on a rate of turn (n, axes) in rad/s that stays away from zero, as an angle does; "" for others."""
    for axis, column in zip("xyz", rates.T, strict=False):
        known = column[np.isfinite(column)]
        if not len(known):
            continue
        usual = float(np.median(known))
        one_way = known * np.sign(usual)
        if np.quantile(one_way, 0.1) > max(SPINS_RAD_S, 0.5 * abs(usual)):
            return (
                f" About {axis} they stay near {usual:.2g}, as an angle does: if the "
                "vehicle did not spin all the time, they are its attitude, and belong under `euler`."
            )
    return ""


def _is_unwrapped(angles: Array) -> bool:
    """Whether only a single angle of several is large, the others far too small for degrees."""
    largest = np.sort(np.nanmax(np.abs(angles), axis=0))
    return len(largest) > 1 and bool(largest[-2] < LEAST_TILT_DEG)


def _force(values: Array) -> Guess:
    known = values[np.isfinite(values).all(axis=1)]
    usual = float(np.median(np.linalg.norm(known, axis=1))) if len(known) else 0.0
    steady = float(np.linalg.norm(np.median(known, axis=0))) if len(known) else 0.0
    for unit, gravity in GRAVITIES:
        if steady > STEADY * usual and gravity / NEAR < usual < gravity * NEAR:
            return Guess(unit, f"Its usual size is {usual:.3g}, which is gravity in {unit}.")
    return Guess(
        "",
        f"Its usual size is {usual:.2g}, and its usual reading {steady:.2g}, which is gravity in no unit; a specific "
        "force includes gravity.",
    )


def _pressure(known: Array) -> Guess:
    least = float(np.quantile(known, 0.01)) if len(known) else 0.0
    for unit in ("Pa", "hPa"):
        if LEAST_AIR_PA < least * PRESSURES[unit] < DEEPEST_PA:
            is_deep = unit == "hPa" and least * PRESSURES[unit] > DEEP * AIR_PA
            other = (
                " It may be Pa from the surface as well, which gets the air's as `offset`." if is_deep else ""
            )
            return Guess(unit, f"The least pressure is {least:.6g}, which fits {unit}.{other}", not is_deep)
    off = {
        unit: abs(math.log(least * PRESSURES[unit] / AIR_PA))
        for unit in ("kPa", "dbar", "psi", "bar")
        if least * PRESSURES[unit] > LEAST_AIR_PA
    }
    if off:
        unit = min(off, key=lambda each: off[each])
        return Guess(
            unit, f"The least pressure is {least:.4g}: at the surface, that is nearest to {unit}.", False
        )
    return Guess(
        "", f"The least pressure is {least:.3g}; absolute pressure is needed, about 1013 hPa at the surface."
    )


def from_surface(values: Array, unit: str) -> Guess | None:
    """A pressure (n, 1) of a known unit that counts from the surface, with the air's added; None for an absolute
    pressure."""
    known = values[np.isfinite(values)]
    least = float(np.quantile(known, 0.01)) if len(known) else np.inf
    if least * PRESSURES[unit] > LEAST_AIR_PA:
        return None
    air = AIR_PA / PRESSURES[unit]
    reason = (
        f"The least pressure is {least:.3g} {unit}, less than the air's: it counts from the surface, and the usual "
        f"{air:.6g} {unit} of the air is added; give that of the day if it is known."
    )
    return Guess(unit, reason, False, offset=air)


def _command(known: Array) -> Guess:
    if not len(known):
        return Guess("", "It holds no values.")
    least, largest = np.quantile(known, (0.001, 0.999)).tolist()
    driven = known[known != 0.0]
    pulses = np.abs(driven - MIDDLE_US) <= MIDDLE_US - LEAST_PULSE_US
    if len(driven) and np.mean(pulses) > 0.95:
        return Guess("us", f"Values lie about {np.median(driven):.0f}, as pulses in microseconds do.")
    size = max(abs(least), abs(largest))
    for full, name in ((1.0, "1"), (100.0, "100 %")):
        if size <= 1.02 * full:
            reason = (
                f"Commands stay within {name}, and {name} is taken for full thrust ahead: for the end of the vehicle "
                "file's thrust_curve; check that."
            )
            return Guess("1", reason, False, scale=1.0 / full)
    return Guess(
        "", f"Values from {least:.4g} to {largest:.4g} are neither pulses nor commands from -1 to 1."
    )
