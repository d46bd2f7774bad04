"""Table of the quantities fitted in addition to the coefficients: a row for each axis, a column for each quantity."""

import re
from collections.abc import Mapping

from bridge.vehicle.coefficients import DOFS
from identify.report.page import Table
from identify.report.text import MISSING, significant

UNITS = {"n": "N", "nm": "N m", "s": "s", "m_s": "m/s", "rad_s": "rad/s", "m": "m", "rad": "rad"}
CHANNELS = {
    "dvl": "DVL",
    "gyro": "IMU gyro",
    "fog": "fibre-optic gyro",
    "filter": "autopilot's filter",
    "depth": "depth sensor",
}

_AXIS = f"(?P<axis>{'|'.join(DOFS)})"
_QUANTITIES = {
    "Disturbance": re.compile(f"{_AXIS}_disturbance_std_(?P<unit>nm?)"),
    "Its time constant": re.compile(f"{_AXIS}_disturbance_time_constant_(?P<unit>s)"),
    "Trim": re.compile(f"{_AXIS}_trim_(?P<unit>nm?)"),
    "Sensor noise": re.compile(f"{_AXIS}_(?P<channel>.+)_noise_std_(?P<unit>m_s|rad_s|m|rad)"),
}


def nuisance_tables(nuisance: Mapping[str, float]) -> tuple[Table, ...]:
    """A table of the names that state axis, quantity and unit; a second table of all other names, unchanged."""
    cells: dict[str, dict[str, list[str]]] = {}
    others: list[tuple[str, ...]] = []
    for name, value in nuisance.items():
        read = _read(name, value)
        if read is None:
            others.append((name, significant(value)))
            continue
        axis, quantity, words = read
        cells.setdefault(axis, {}).setdefault(quantity, []).append(words)
    tables = []
    if cells:
        rows = tuple(
            (axis, *(", ".join(row.get(quantity, [MISSING])) for quantity in _QUANTITIES))
            for axis, row in cells.items()
        )
        caption = (
            "Fitted beside the coefficients. Disturbance and noise are standard deviations; trim is a "
            "constant force or moment."
        )
        tables.append(Table(("Axis", *_QUANTITIES), rows, caption))
    if others:
        caption = "Other numbers of this method, by their own names."
        tables.append(Table(("Name", "Value"), tuple(others), caption))
    return tuple(tables)


def _read(name: str, value: float) -> tuple[str, str, str] | None:
    """Axis, quantity, and the value in words with its unit; None for a name of another form."""
    for quantity, pattern in _QUANTITIES.items():
        if matched := pattern.fullmatch(name):
            parts = matched.groupdict()
            sensor = CHANNELS.get(parts.get("channel", ""), parts.get("channel", ""))
            words = f"{sensor} {significant(value)} {UNITS[parts['unit']]}"
            return parts["axis"], quantity, words.strip()
    return None
