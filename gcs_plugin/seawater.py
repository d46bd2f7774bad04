"""Density of sea water at the surface from temperature and salinity: EOS-80, UNESCO (1981).

N. P. Fofonoff and R. C. Millard, Algorithms for computation of fundamental properties of seawater, UNESCO technical
papers in marine science 44 (1983): at a pressure of 1 atm. At 100 m depth the density is 0.5 kg/m3 higher.
"""

from typing import Final

COLDEST_C, WARMEST_C = -2.0, 40.0
SALTIEST: Final = 42.0
"""Range of validity of the equation."""


def density_kg_m3(temperature_c: float, salinity: float) -> float:
    """Density, kg/m3, from temperature (°C, IPTS-68, 0.01 °C off today's scale) and practical salinity (0: fresh)."""
    t, s = temperature_c, salinity
    fresh = _poly(t, 999.842594, 6.793952e-2, -9.095290e-3, 1.001685e-4, -1.120083e-6, 6.536332e-9)
    first = _poly(t, 8.24493e-1, -4.0899e-3, 7.6438e-5, -8.2467e-7, 5.3875e-9)
    second = _poly(t, -5.72466e-3, 1.0227e-4, -1.6546e-6)
    return fresh + first * s + second * float(s**1.5) + 4.8314e-4 * s**2


def _poly(x: float, *coefficients: float) -> float:
    """Polynomial in `x` by Horner's scheme, the constant coefficient first."""
    value = 0.0
    for coefficient in reversed(coefficients):
        value = value * x + coefficient
    return value
