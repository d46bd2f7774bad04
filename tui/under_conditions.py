"""Apply a dive's conditions to its analysis: water and mass of the vehicle file, and causes that are ruled out."""

from dataclasses import replace
from pathlib import Path
from typing import Final

from bridge.vehicle.config import Configuration, VehicleFile
from gcs_plugin.conditions import Conditions
from gcs_plugin.folder import DiveFolder

TETHER: Final = "tether"
TOTAL_MASSES: Final = ("M_u", "M_v", "M_w")
LEAST_CHANGE_KG_M3: Final = 0.1
"""Least change of density that is applied: 1 mm of depth at 10 m."""


def under_conditions(file: VehicleFile, dive: Path) -> tuple[VehicleFile, tuple[str, ...]]:
    """The vehicle file for a dive folder, or a recording in it, and the changes by its `dive.yaml`, in sentences.

    The mass carried adds to the dry mass, and to the total masses of the file's model, which assume that dry mass.
    """
    conditions = _of(dive)
    vehicle, changes = file.vehicle, []
    density, filed = conditions.density_kg_m3, vehicle.water.density_kg_m3
    if density is not None and abs(density - filed) >= LEAST_CHANGE_KG_M3:
        vehicle = replace(vehicle, water=replace(vehicle.water, density_kg_m3=density))
        changes.append(
            f"water of {density:.1f} kg/m3 by the dive's temperature and salinity, not the vehicle file's {filed:.1f}"
        )
    if carried_kg := conditions.carried_kg:
        shapes = {name: _heavier(shape, carried_kg) for name, shape in vehicle.configurations.items()}
        vehicle = replace(vehicle, configurations=shapes)
        changes.append(f"{carried_kg:+g} kg of ballast and payload on top of the vehicle file's dry mass")
    return replace(file, vehicle=vehicle), tuple(f"{dive.name}: {sentence}" for sentence in changes)


def can_not_be(dive: Path) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Effects that the `dive.yaml` rules out as causes of a dive's gap, and the reason, in sentences."""
    if _of(dive).tether_out_m != 0.0:
        return (), ()
    return (TETHER,), (f"{dive.name}: no tether was out, so a tether is not among the causes",)


def _of(dive: Path) -> Conditions:
    """The conditions of a dive folder, or of a recording in it."""
    return DiveFolder(dive if dive.is_dir() else dive.parent).about().conditions


def _heavier(shape: Configuration, carried_kg: float) -> Configuration:
    model = {name: value + carried_kg * (name in TOTAL_MASSES) for name, value in shape.model.items()}
    return replace(shape, dry_mass_kg=shape.dry_mass_kg + carried_kg, model=model)
