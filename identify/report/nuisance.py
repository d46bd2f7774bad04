"""What was fitted beside the coefficients, in words and units: an axis a row, a quantity a column."""

import re
from collections.abc import Callable, Mapping

from bridge.vehicle.coefficients import DOFS
from identify.report.page import Table
from identify.report.text import MISSING, significant

UNITS = {"n": "N", "nm": "N m", "s": "s", "m_s": "m/s", "rad_s": "rad/s", "m": "m", "rad": "rad"}
CHANNELS = {
    "dvl": "DVL",
    "gyro": "IMU gyro",
    "fog": "fibre-optic gyro",
    "filter": "the autopilot's filter",
    "depth": "depth sensor",
}

_AXIS = f"(?P<axis>{'|'.join(DOFS)})"
_QUANTITIES: tuple[tuple[re.Pattern[str], Callable[[re.Match[str]], str]], ...] = (
    (re.compile(f"{_AXIS}_disturbance_std_(?P<unit>nm?)"), lambda _: "Disturbance"),
    (re.compile(f"{_AXIS}_disturbance_time_constant_(?P<unit>s)"), lambda _: "Its time constant"),
    (re.compile(f"{_AXIS}_trim_(?P<unit>nm?)"), lambda _: "Trim"),
    (
        re.compile(f"{_AXIS}_(?P<channel>.+)_noise_std_(?P<unit>m_s|rad_s|m|rad)"),
        lambda found: f"Noise of {CHANNELS.get(found['channel'], found['channel'])}",
    ),
)


def nuisance_tables(nuisance: Mapping[str, float]) -> tuple[Table, ...]:
    """A table of the names that say their axis, quantity and unit; a second one of all others, as they are."""
    cells: dict[str, dict[str, str]] = {}
    quantities: list[str] = []
    others: list[tuple[str, ...]] = []
    for name, value in nuisance.items():
        read = _read(name)
        if read is None:
            others.append((name, significant(value)))
            continue
        axis, quantity, unit = read
        cells.setdefault(axis, {})[quantity] = f"{significant(value)} {unit}"
        if quantity not in quantities:
            quantities.append(quantity)
    tables = []
    if cells:
        rows = tuple((axis, *(row.get(q, MISSING) for q in quantities)) for axis, row in cells.items())
        caption = (
            "Fitted beside the coefficients. Disturbance and noise are standard deviations; trim is a "
            "constant force or moment."
        )
        tables.append(Table(("Axis", *quantities), rows, caption))
    if others:
        tables.append(
            Table(("Name", "Value"), tuple(others), "Other numbers of this method, by their own names.")
        )
    return tuple(tables)


def _read(name: str) -> tuple[str, str, str] | None:
    """Axis, quantity in words and unit of a name; None for one of another form."""
    for pattern, words in _QUANTITIES:
        if found := pattern.fullmatch(name):
            return found["axis"], words(found), UNITS[found["unit"]]
    return None
