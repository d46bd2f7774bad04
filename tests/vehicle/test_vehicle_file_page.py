"""docs/vehicle_file.md names every field of a vehicle file, and its example loads."""

import re
from dataclasses import MISSING, fields
from pathlib import Path

import pytest

from bridge.vehicle.config import (
    Configuration,
    Device,
    Mounting,
    Prior,
    Sensors,
    ThrustCurve,
    Thruster,
    Vehicle,
    Water,
    load_vehicle,
)
from bridge.vehicle.thrusters import Allocator, thrust_curve

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "vehicle_file.md").read_text(encoding="utf-8")
HEADINGS = {
    Vehicle: "field",
    Water: "field",
    ThrustCurve: "field",
    Device: "field of a device",
    Mounting: "field of `mounting`",
    Configuration: "field",
    Thruster: "field of a thruster",
    Prior: "field",
}


def rows(of: type) -> dict[str, list[str]]:
    """The cells beside each field of the one table that names all of a dataclass's fields."""
    wanted = {field.name for field in fields(of)}
    found = []
    for table in re.findall(r"(?:^\|.*\n)+", PAGE, re.M):
        lines = [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in table.splitlines()]
        named = {name: line[1:] for line in lines[2:] for name in re.findall(r"`(\w+)`", line[0])}
        if lines[0][0] == HEADINGS[of] and set(named) == wanted:
            found.append(named)
    assert len(found) == 1, f"no one table names just {sorted(wanted)} of {of.__name__}"
    return found[0]


@pytest.mark.parametrize("of", HEADINGS, ids=lambda of: of.__name__)
def test_one_table_names_every_field_and_says_what_it_means(of: type) -> None:
    for field in fields(of):
        _, default, meaning = rows(of)[field.name]
        must_be_given = field.default is MISSING and field.default_factory is MISSING
        assert bool(default) != must_be_given, field.name
        assert meaning, field.name


@pytest.mark.parametrize("of", HEADINGS, ids=lambda of: of.__name__)
def test_a_default_that_is_a_number_is_the_one_in_the_table(of: type) -> None:
    numbers = {
        field.name: float(field.default)
        for field in fields(of)
        if isinstance(field.default, int | float) and field.name != "rate_hz"
    }
    for name, default in numbers.items():
        told = [float(number) for number in re.findall(r"\d+(?:\.\d+)?", rows(of)[name][1])]
        assert default in told, name


def test_every_sensor_is_named() -> None:
    assert all(f"`{field.name}`" in PAGE for field in fields(Sensors))


def test_the_least_file_loads_and_its_thrusters_push(tmp_path: Path) -> None:
    (example,) = re.findall(r"```yaml\n(.*?)```", PAGE, re.S)
    path = tmp_path / "our.yaml"
    path.write_text(example, encoding="utf-8")
    vehicle = load_vehicle(f"{path}:open").vehicle
    curve = thrust_curve(vehicle.thrust_curve, tmp_path)
    thrust_n, _, _ = Allocator(vehicle.configurations["open"], curve).allocate(
        [10.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    )
    assert list(thrust_n) == pytest.approx([5.0, 5.0, 0.0, 0.0])


def test_it_says_how_a_wrong_thrust_scale_and_a_wrong_lag_show() -> None:
    assert "thrust acts at another time than the vehicle file's lag" in PAGE.replace("\n", " ")
    assert "moved the yaw inertia I_r by 3.6 %" in re.sub(r"\s+", " ", PAGE)
