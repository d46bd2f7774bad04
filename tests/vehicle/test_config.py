"""What a vehicle file may not say."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from bridge.errors import ConfigError
from bridge.vehicle.config import load_vehicle

BODY: dict[str, Any] = {
    "dry_mass_kg": 10.0,
    "inertia_kgm2": [1.0, 1.0, 1.0],
    "thrusters": [{"direction": [1.0, 0.0, 0.0], "position_m": [0.0, 0.0, 0.0]}],
}


def loaded(folder: Path, body: dict[str, Any] | None = None, **vehicle: Any) -> Any:
    data = {"name": "mine", "configurations": {"only": BODY | (body or {})}} | vehicle
    path = folder / "mine.yaml"
    path.write_text(yaml.safe_dump(data), encoding="utf-8")
    return load_vehicle(str(path)).vehicle


def test_a_plain_vehicle_is_loaded_with_its_defaults(tmp_path: Path) -> None:
    vehicle = loaded(tmp_path)
    assert (vehicle.system_id, vehicle.component_id) == (1, 1)
    assert vehicle.configurations["only"].thruster_limit_n == 40.0


@pytest.mark.parametrize(
    ("body", "vehicle", "says"),
    [
        ({"dry_mass_kg": 0.0}, {}, "dry_mass_kg must be above 0"),
        ({"thruster_limit_n": 0.0}, {}, "thruster_limit_n must be above 0"),
        ({}, {"water": {"density_kg_m3": 0.0}}, "density_kg_m3 must be above 0"),
        ({}, {"thrust_curve": {"span_us": 0.0}}, "span_us must be above 0"),
        ({}, {"thrust_curve": {"lag_s": -0.1}}, "lag_s can't be negative, it is -0.1"),
        ({}, {"thrust_curve": {"delay_s": 50.0}}, "delay_s is in seconds and at most 2, it is 50"),
        ({}, {"sensors": {"esc": {"kind": "esc", "poles": 0}}}, "poles must be above 0"),
        ({}, {"sensors": {"imu": {"kind": "mti300", "rate_hz": -1.0}}}, "rate_hz can't be negative"),
        ({}, {"sensors": {"dvl": {"kind": "a50", "mounting": {"signs": [1, 0, 1]}}}}, "signs are 1 or -1"),
        ({}, {"system_id": 256}, "system_id must lie in 1 to 255"),
        ({}, {"component_id": 0}, "component_id must lie in 1 to 255"),
    ],
)
def test_a_number_that_no_vehicle_can_have_is_refused(
    tmp_path: Path, body: dict[str, Any], vehicle: dict[str, Any], says: str
) -> None:
    with pytest.raises(ConfigError, match=says):
        loaded(tmp_path, body, **vehicle)
