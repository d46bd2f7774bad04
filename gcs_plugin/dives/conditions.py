"""Conditions of a dive that may later explain a sim-to-real gap: water, tether, ballast, payload, weather.

The density of sea water at the surface follows from temperature and salinity: EOS-80, N. P. Fofonoff and R. C. Millard,
Algorithms for computation of fundamental properties of seawater, UNESCO technical papers in marine science 44 (1983).
At 100 m depth it is 0.5 kg/m3 higher.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Final

from numpy.polynomial.polynomial import polyval

from bridge.errors import ConfigError

COLDEST_C, WARMEST_C = -2.0, 40.0
SALTIEST: Final = 42.0
"""Range of validity of the equation."""


def density_kg_m3(temperature_c: float, salinity: float) -> float:
    """Density, kg/m3, from temperature (°C, IPTS-68, 0.01 °C off today's scale) and practical salinity (0: fresh)."""
    t, s = temperature_c, salinity
    fresh = polyval(t, (999.842594, 6.793952e-2, -9.095290e-3, 1.001685e-4, -1.120083e-6, 6.536332e-9))
    first = polyval(t, (8.24493e-1, -4.0899e-3, 7.6438e-5, -8.2467e-7, 5.3875e-9))
    second = polyval(t, (-5.72466e-3, 1.0227e-4, -1.6546e-6))
    return float(fresh + first * s + second * s**1.5 + 4.8314e-4 * s**2)


TETHER: Final = "tether"
MOST_KG: Final = 1000.0
LONGEST_M: Final = 10000.0
LIMITS: Final[Mapping[str, tuple[float, float, str]]] = {
    "water_temperature_c": (COLDEST_C, WARMEST_C, " °C"),
    "salinity": (0.0, SALTIEST, ""),
    "tether_out_m": (0.0, LONGEST_M, " m"),
    "ballast_kg": (-MOST_KG, MOST_KG, " kg"),
    "payload_kg": (-MOST_KG, MOST_KG, " kg"),
}
"""Least and most of each number, and its unit as text."""


@dataclass(frozen=True)
class Conditions:
    """Conditions of a dive; None and "" mean not known.

    `salinity` is practical salinity: 0 for fresh water, 35 for the ocean. `ballast_kg` and `payload_kg` are masses in
    air in addition to the vehicle file's dry mass; negative for removed mass.
    """

    water_temperature_c: float | None = None
    salinity: float | None = None
    tether_out_m: float | None = None
    ballast_kg: float | None = None
    payload_kg: float | None = None
    payload: str = ""
    weather: str = ""

    def __post_init__(self) -> None:
        for name in LIMITS:
            value = getattr(self, name)
            if value is not None and (why := why_not(name, value)):
                raise ValueError(f"{name} {why}")

    @property
    def density_kg_m3(self) -> float | None:
        """Density of the water, None unless both temperature and salinity are known."""
        if self.water_temperature_c is None or self.salinity is None:
            return None
        return density_kg_m3(self.water_temperature_c, self.salinity)

    @property
    def carried_kg(self) -> float:
        """Ballast and payload in addition to the vehicle file's dry mass."""
        return (self.ballast_kg or 0.0) + (self.payload_kg or 0.0)

    @property
    def impossible(self) -> tuple[str, ...]:
        """Effects of the library that can't have acted on this dive."""
        return (TETHER,) if self.tether_out_m == 0.0 else ()

    @property
    def words(self) -> str:
        """All known conditions in a line of text; "" if none is known."""
        numbers = [
            f"{title} {value:g}{f' {unit}' if unit else ''}"
            for title, unit, value in (
                ("water", "°C", self.water_temperature_c),
                ("salinity", "", self.salinity),
                ("tether out", "m", self.tether_out_m),
                ("ballast", "kg", self.ballast_kg),
                ("payload", "kg", self.payload_kg),
            )
            if value is not None
        ]
        return ", ".join([*numbers, *filter(None, (self.payload, self.weather))])


def why_not(name: str, value: float) -> str:
    """Why a value is out of the limits of its field, "" if it is within them; NaN is not."""
    least, most, unit = LIMITS[name]
    return "" if least <= value <= most else f"must lie from {least:g} to {most:g}{unit}, it is {value:g}"


NOTHING_SAID: Final = Conditions()


TITLES: Mapping[str, str] = {
    "water_temperature_c": "water temperature, °C",
    "salinity": "salinity (0 fresh, 35 ocean)",
    "tether_out_m": "tether out, m",
    "ballast_kg": "ballast, kg beyond the file's",
    "payload_kg": "payload, kg beyond the file's",
    "payload": "payload, what it is",
    "weather": "weather and sea",
}
"""Labels of the form, by field."""


def texts_of(conditions: Conditions) -> dict[str, str]:
    """Texts of the conditions for a form, by field."""
    values = {field.name: getattr(conditions, field.name) for field in fields(Conditions)}
    return {name: _text(value) for name, value in values.items()}


def _text(value: float | str | None) -> str:
    if value is None:
        return ""
    return value if isinstance(value, str) else f"{value}".removesuffix(".0")


def mistakes(texts: Mapping[str, str]) -> dict[str, str]:
    """Error sentence for each field with an invalid text; empty if all texts are valid."""
    sentences = {name: _mistake(name, _bare(texts, name)) for name in LIMITS}
    return {name: sentence for name, sentence in sentences.items() if sentence}


def of_texts(texts: Mapping[str, str]) -> Conditions:
    """Conditions from the texts; a field whose text is missing or empty is not known.

    Raises ConfigError for invalid texts.
    """
    if wrong := mistakes(texts):
        raise ConfigError(". ".join(f"{name}: {sentence}" for name, sentence in wrong.items()))
    values: dict[str, float | str | None] = {}
    for field in fields(Conditions):
        text = _bare(texts, field.name)
        values[field.name] = text if field.name not in LIMITS else _number(text) if text else None
    return Conditions(**values)  # type: ignore[arg-type]


def _bare(texts: Mapping[str, str], name: str) -> str:
    return " ".join(texts.get(name, "").split())


def _number(text: str) -> float:
    """Number in a text, with a decimal point or comma. Raises ValueError."""
    return float(text.replace(",", "."))


def _mistake(name: str, text: str) -> str:
    """Error sentence for the text of a number, "" if it is valid or empty."""
    if not text:
        return ""
    try:
        why = why_not(name, _number(text))
    except ValueError:
        return f"'{text}' is no number; give one such as 12.5, or leave it empty"
    return why and f"{why}; mend it, or leave it empty"
