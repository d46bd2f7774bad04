"""Units that a column map may name, by signal, each with its exact factor to the Dive's.

Factors follow from definitions: inch 25.4 mm, foot 12 inches, nautical mile 1852 m, pound 0.45359237 kg, standard
gravity 9.80665 m/s2 (Thompson and Taylor 2008, NIST SP 811, appendix B.8); decibar and the bar's other parts are of SI.
"""

import math

from bridge.vehicle.config import GRAVITY_M_S2

INCH_M = 0.0254
FOOT_M = 12 * INCH_M
KNOT_M_S = 1852 / 3600
POUND_N = 0.45359237 * GRAVITY_M_S2
PSI_PA = POUND_N / INCH_M**2
AIR_PA = 101_325.0
"""The standard atmosphere."""
DEGREE = math.pi / 180

_LENGTH = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "ft": FOOT_M, "in": INCH_M}
_TURN = {"rad/s": 1.0, "deg/s": DEGREE, "mrad/s": 1e-3, "deg/h": DEGREE / 3600}
_FORCE = {"N": 1.0, "kN": 1e3, "kgf": GRAVITY_M_S2, "lbf": POUND_N}

UNITS: dict[str, dict[str, float]] = {
    "velocity": {
        "m/s": 1.0, "cm/s": 1e-2, "mm/s": 1e-3, "km/h": 1 / 3.6, "ft/s": FOOT_M, "in/s": INCH_M, "kn": KNOT_M_S,
        "knot": KNOT_M_S,
    },
    "gyro": _TURN, "fog": _TURN,
    "specific_force": {"m/s2": 1.0, "g": GRAVITY_M_S2, "mg": GRAVITY_M_S2 * 1e-3, "ft/s2": FOOT_M},
    "quaternion": {"1": 1.0}, "euler": {"rad": 1.0, "deg": DEGREE},
    "pressure": {
        "Pa": 1.0, "hPa": 100.0, "mbar": 100.0, "kPa": 1e3, "dbar": 1e4, "bar": 1e5, "psi": PSI_PA,
    },
    "depth": _LENGTH, "altitude": _LENGTH,
    "pwm": {"us": 1.0, "ms": 1e3, "1": 1.0, **_FORCE},
    "rpm": {"rpm": 1.0, "rev/s": 60.0, "rad/s": 30 / math.pi, "deg/s": 1 / 6},
    "voltage": {"V": 1.0, "mV": 1e-3}, "tau_cmd": _FORCE, "armed": {"1": 1.0},
}  # fmt: skip
"""By signal and unit, the factor to the unit that the Dive holds, which is the first."""
