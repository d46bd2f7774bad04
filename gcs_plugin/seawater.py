"""Density of sea water at the surface by temperature and salinity: EOS-80, UNESCO (1981).

N. P. Fofonoff and R. C. Millard, Algorithms for computation of fundamental properties of seawater, UNESCO technical
papers in marine science 44 (1983): of one atmosphere. A hundred metres deeper it is 0.5 kg/m3 more.
"""

from typing import Final

COLDEST_C, WARMEST_C = -2.0, 40.0
SALTIEST: Final = 42.0
"""Where the equation holds."""


def density_kg_m3(temperature_c: float, salinity: float) -> float:
    """Of water of a temperature (C, by the scale of 1968, 0.01 C off today's) and a practical salinity, 0 for fresh."""
    t, s = temperature_c, salinity
    fresh = _poly(t, 999.842594, 6.793952e-2, -9.095290e-3, 1.001685e-4, -1.120083e-6, 6.536332e-9)
    first = _poly(t, 8.24493e-1, -4.0899e-3, 7.6438e-5, -8.2467e-7, 5.3875e-9)
    second = _poly(t, -5.72466e-3, 1.0227e-4, -1.6546e-6)
    return fresh + first * s + second * float(s**1.5) + 4.8314e-4 * s**2


def _poly(x: float, *coefficients: float) -> float:
    """By Horner's scheme, the constant first."""
    value = 0.0
    for coefficient in reversed(coefficients):
        value = value * x + coefficient
    return value
