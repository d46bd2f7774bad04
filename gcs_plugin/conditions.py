"""Conditions of a dive that may later explain a sim-to-real gap: water, tether, ballast, payload, weather."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Final

from gcs_plugin.seawater import COLDEST_C, SALTIEST, WARMEST_C, density_kg_m3

MOST_KG: Final = 1000.0
LONGEST_M: Final = 10000.0
LIMITS: Final[Mapping[str, tuple[float, float]]] = {
    "water_temperature_c": (COLDEST_C, WARMEST_C),
    "salinity": (0.0, SALTIEST),
    "tether_out_m": (0.0, LONGEST_M),
    "ballast_kg": (-MOST_KG, MOST_KG),
    "payload_kg": (-MOST_KG, MOST_KG),
}


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
    least, most = LIMITS[name]
    return "" if least <= value <= most else f"must lie from {least:g} to {most:g}, it is {value:g}"


NOTHING_SAID: Final = Conditions()
NAMES: Final = tuple(field.name for field in fields(Conditions))
