"""A vehicle file: its refusals, and the page that names each of its fields."""

import re
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

import pytest
import yaml

from bridge.errors import ConfigError
from bridge.vehicle.coefficients import COEFFICIENTS, effect_coefficients
from bridge.vehicle.config import (
    CONFIGS,
    MOST_VEH_CFG,
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
    shipped_vehicles,
)
from bridge.vehicle.thrusters import Allocator, thrust_curve
from gcs_plugin.params.files import NAME_LENGTH
from identify.ingest.mapping.column_map import map_file

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


@pytest.mark.parametrize(
    "wrong",
    [
        {"dry_mass_kg": 10_000.0},
        {"inertia_kgm2": [900.0, 900.0, 1000.0]},
        {"thrusters": [{"direction": [1.0, 0.0, 0.0], "position_m": [300.0, 0.0, 0.0]}]},
    ],
)
def test_a_hull_in_grams_or_millimetres_is_refused_with_the_units_to_give(tmp_path, wrong):
    thrusters = [{"direction": [1.0, 0.0, 0.0], "position_m": [0.3, 0.0, 0.0]}]
    assert loaded(tmp_path, {"thrusters": thrusters})
    with pytest.raises(
        ConfigError, match=r"radius of gyration .* mass in kg, the inertia in kg m2 and positions"
    ):
        loaded(tmp_path, {"thrusters": thrusters} | wrong)


def test_a_plain_vehicle_is_loaded_with_its_defaults(tmp_path):
    vehicle = loaded(tmp_path)
    assert (vehicle.system_id, vehicle.component_id) == (1, 1)
    assert vehicle.configurations["only"].thruster_limit_n == 40.0


def test_a_rigid_body_is_known_to_one_per_cent_and_five_unless_the_file_says_better(tmp_path):
    body = {"dry_mass_kg": 20.0, "inertia_kgm2": [1.0, 2.0, 3.0]}
    plain = loaded(tmp_path, body).configurations["only"]
    assert [plain.rigid_body(dof) for dof in (0, 2, 4)] == [(20.0, 0.2), (20.0, 0.2), (2.0, 0.1)]
    weighed = body | {"dry_mass_std_kg": 0.3, "inertia_std_kgm2": [0.4, 0.5, 0.6]}
    told = loaded(tmp_path, weighed).configurations["only"]
    assert [told.rigid_body(dof) for dof in (0, 3, 5)] == [(20.0, 0.3), (1.0, 0.4), (3.0, 0.6)]


@pytest.mark.parametrize(
    ("body", "vehicle", "says"),
    [
        ({"dry_mass_kg": 0.0}, {}, "dry_mass_kg must be above 0"),
        ({"thruster_limit_n": 0.0}, {}, "thruster_limit_n must be above 0"),
        ({"veh_cfg": -1}, {}, "veh_cfg is a number from 0 to 99999, .*; it is -1"),
        ({"veh_cfg": 100_000}, {}, "veh_cfg is a number from 0 to 99999"),
        ({}, {"water": {"density_kg_m3": 0.0}}, "density_kg_m3 must be above 0"),
        ({}, {"thrust_curve": {"span_us": 0.0}}, "span_us must be above 0"),
        ({}, {"thrust_curve": {"neutral_us": 0.0}}, "neutral_us must be above 0"),
        ({"model": {"M_x": 1.0}}, {}, "model: unknown coefficient 'M_x'; known: M_u, "),
        (
            {"damping": "linear", "priors": {"X_uu": {"value": 1.0, "std": 1.0}}},
            {},
            "priors: X_uu is quadratic",
        ),
        ({"priors": {"M_u": {"value": 0.0, "std": 1.0}}}, {}, "value must be above 0"),
        ({"priors": {"M_u": {"value": 90.0, "std": 0.0}}}, {}, "std must be above 0"),
        ({}, {"sensors": {"dvl": {"kind": "a50", "baud": 0}}}, "baud must be above 0"),
        ({}, {"thrust_curve": {"lag_s": -0.1}}, "lag_s can't be negative, it is -0.1"),
        ({}, {"thrust_curve": {"delay_s": 50.0}}, "delay_s is in seconds and at most 2, it is 50"),
        ({}, {"sensors": {"esc": {"kind": "esc", "poles": 0}}}, "poles must be above 0"),
        ({}, {"sensors": {"imu": {"kind": "mti300", "rate_hz": -1.0}}}, "rate_hz can't be negative"),
        ({}, {"sensors": {"dvl": {"kind": "a50", "mounting": {"signs": [1, 0, 1]}}}}, "signs are 1 or -1"),
        ({}, {"system_id": 256}, "system_id must lie in 1 to 255"),
        ({}, {"component_id": 0}, "component_id must lie in 1 to 255"),
    ],
)
def test_a_number_that_no_vehicle_can_have_is_refused(tmp_path, body, vehicle, says):
    with pytest.raises(ConfigError, match=says):
        loaded(tmp_path, body, **vehicle)


def test_the_largest_veh_cfg_leaves_every_parameter_a_name_that_mavlink_carries(tmp_path):
    shape = loaded(tmp_path, {"veh_cfg": MOST_VEH_CFG}).configurations["only"]
    of_all = (*COEFFICIENTS, *effect_coefficients(shape))
    assert max(len(each.parameter_id(MOST_VEH_CFG)) for each in of_all) == NAME_LENGTH


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
    results = []
    for table in re.findall(r"(?:^\|.*\n)+", PAGE, re.M):
        lines = [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in table.splitlines()]
        named = {name: line[1:] for line in lines[2:] for name in re.findall(r"`(\w+)`", line[0])}
        if lines[0][0] == HEADINGS[of] and set(named) == wanted:
            results.append(named)
    assert len(results) == 1, f"no one table names just {sorted(wanted)} of {of.__name__}"
    return results[0]


@pytest.mark.parametrize("of", HEADINGS, ids=lambda of: of.__name__)
def test_one_table_names_every_field_and_says_what_it_means(of):
    for field in fields(of):
        _, default, meaning = rows(of)[field.name]
        must_be_given = field.default is MISSING and field.default_factory is MISSING
        assert bool(default) != must_be_given, field.name
        assert meaning, field.name


@pytest.mark.parametrize("of", HEADINGS, ids=lambda of: of.__name__)
def test_a_default_that_is_a_number_is_the_one_in_the_table(of):
    numbers = {
        field.name: float(field.default)
        for field in fields(of)
        if isinstance(field.default, int | float)
        and not isinstance(field.default, bool)
        and field.name != "rate_hz"
    }
    for name, default in numbers.items():
        in_table = [float(number) for number in re.findall(r"\d+(?:\.\d+)?", rows(of)[name][1])]
        assert default in in_table, name


def test_every_sensor_is_named():
    assert all(f"`{field.name}`" in PAGE for field in fields(Sensors))


def test_the_least_file_loads_and_its_thrusters_push(tmp_path):
    (example,) = re.findall(r"```yaml\n(.*?)```", PAGE, re.S)
    path = tmp_path / "our.yaml"
    path.write_text(example, encoding="utf-8")
    vehicle = load_vehicle(f"{path}:open").vehicle
    curve = thrust_curve(vehicle.thrust_curve, tmp_path)
    thrust_n, _, _ = Allocator(vehicle.configurations["open"], curve).allocate(
        [10.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    )
    assert list(thrust_n) == pytest.approx([5.0, 5.0, 0.0, 0.0])


def test_a_folder_of_the_same_name_hides_neither_vehicle_nor_column_map(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bolt").mkdir()
    assert load_vehicle("bolt").path == CONFIGS / "vehicles" / "bolt.yaml"
    assert map_file("bolt") == CONFIGS / "columns" / "bolt.yaml"


@pytest.mark.parametrize("name", ["a" * 300, f"{'a' * 300}:hovering"])
def test_a_name_that_no_folder_can_hold_is_refused_with_a_sentence(name):
    with pytest.raises(ConfigError, match="give another file"):
        load_vehicle(name)


def test_of_what_is_shipped_the_truth_of_a_simulated_vehicle_is_no_vehicle():
    assert shipped_vehicles() == ["ardusub_vectored", "bluerov2", "bluerov2_heavy", "bolt", "ruvifist"]


def test_the_sensors_that_a_vehicle_has_are_those_of_its_file():
    imu = Device("mti300", rate_hz=100.0)
    assert Sensors(imu=imu).present() == {"imu": imu}


def test_a_recording_of_a_configuration_that_a_file_lacks_may_be_another_vehicles():
    with pytest.raises(
        ConfigError, match="give the file of the vehicle that was recorded, or name one: --vehicle"
    ):
        load_vehicle("bluerov2").vehicle.configuration_at(1)
    with pytest.raises(ConfigError, match=r"has 0 survey, 1 hovering; name one: --vehicle"):
        load_vehicle("ruvifist").vehicle.configuration_at(None)
