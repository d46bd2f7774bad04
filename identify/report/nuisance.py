"""Noise levels, time constants and trims in words and units: a row for each axis, a column for each quantity."""

from collections.abc import Mapping

from identify.nuisance import WRITTEN, Nuisance, Quantity
from identify.report.page import Table
from identify.report.text import MISSING, significant

CHANNELS = {
    "dvl": "DVL",
    "gyro": "IMU gyro",
    "fog": "fibre-optic gyro",
    "filter": "autopilot's filter",
    "depth": "depth sensor",
}

HEADINGS = {
    Quantity.DISTURBANCE: "Disturbance",
    Quantity.TIME_CONSTANT: "Its time constant",
    Quantity.TRIM: "Trim",
    Quantity.NOISE: "Sensor noise",
}


def nuisance_tables(nuisance: Mapping[Nuisance, float], settings: Mapping[str, float]) -> tuple[Table, ...]:
    """A table of the quantities of each axis, and one of the method's own numbers, by their names."""
    cells: dict[str, dict[Quantity, list[str]]] = {}
    for fitted, value in nuisance.items():
        cells.setdefault(fitted.axis, {}).setdefault(fitted.quantity, []).append(_words(fitted, value))
    tables = []
    if cells:
        rows = tuple(
            (axis, *(", ".join(row.get(quantity, [MISSING])) for quantity in HEADINGS))
            for axis, row in cells.items()
        )
        caption = (
            "Fitted beside the coefficients. Disturbance and noise are standard deviations; trim is a "
            "constant force or moment."
        )
        tables.append(Table(("Axis", *HEADINGS.values()), rows, caption))
    if settings:
        caption = "Other numbers of this method, by their own names."
        tables.append(
            Table(
                ("Name", "Value"),
                tuple((name, significant(value)) for name, value in settings.items()),
                caption,
            )
        )
    return tuple(tables)


def _words(fitted: Nuisance, value: float) -> str:
    sensor = CHANNELS.get(fitted.channel, fitted.channel)
    return f"{sensor} {significant(value)} {WRITTEN[fitted.unit]}".strip()
