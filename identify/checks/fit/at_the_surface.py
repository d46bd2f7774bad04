"""Doubts about a vehicle that never went under by its depth: hull half out of the water, and waves, are in no model
of it; and a depth above the water is none."""

from collections.abc import Collection

import numpy as np

from bridge.vehicle.coefficients import HEAVE, OF_HULL
from bridge.vehicle.config import VehicleFile
from identify.dive import Dive
from identify.doubt import Doubt

MOST_AFLOAT = 0.95
"""Share of the depths at the surface from which a vehicle counts as having stayed there: dives begin and end afloat,
and a sensor may spike."""


def draught_m(dry_mass_kg: float, density_kg_m3: float) -> float:
    """Height of a hull by its mass: the side of a cube of the water that it displaces."""
    return float(np.cbrt(dry_mass_kg / density_kg_m3))


def surface_doubts(
    dive: Dive, file: VehicleFile, configuration: str, fitted: Collection[str]
) -> tuple[Doubt, ...]:
    """Return a warning about all coefficients that were fitted to a dive whose depth stays within a hull's height of
    zero, or about those of heave where it is above the water; none without a depth."""
    water, depth = file.vehicle.water, dive.depth_by(file.vehicle.water)
    about = tuple(name for name in OF_HULL if name in fitted)
    if depth is None or not about:
        return ()
    read_m = depth.finite().value[:, 0]
    height_m = draught_m(file.vehicle.configurations[configuration].dry_mass_kg, water.density_kg_m3)
    if len(read_m) and np.mean(read_m < -height_m) >= MOST_AFLOAT:
        return (
            Doubt(
                tuple(name for name in about if OF_HULL[name].dof == HEAVE) or about,
                f"The depth is above the water: {-np.median(read_m):.2g} m in the median",
                "where it counts upwards, give it `scale: -1` in the map; where it comes of a pressure, look at the "
                "sensor's zero and at the vehicle file's `surface_pressure_hpa`; a depth that runs backwards turns "
                "heave's mass and drag about.",
            ),
        )
    if not len(read_m) or np.mean(np.abs(read_m) <= height_m) < MOST_AFLOAT:
        return ()
    return (
        Doubt(
            about,
            f"The vehicle hardly left the surface: its depth stays within {height_m:.2g} m of zero",
            "a hull that is half out of the water, and in waves, has other masses and drags than one that is under: "
            "the values hold for this dive alone; dive a metre or more deep, and if it was deep, check the depth "
            "sensor and its zero.",
        ),
    )
