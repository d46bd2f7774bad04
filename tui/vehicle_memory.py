"""A vehicle's own parameters, kept in a file: what the bridge and the simulated vehicle start with."""

from pathlib import Path

from bridge.parameters import ParameterServer, vehicle_table
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.hull import hull_mark
from tui import show


def server(file: VehicleFile, store: Path | None) -> ParameterServer:
    """Those of the vehicle of a file, kept in `store`; forgotten at the end where that is None. What is wrong with the
    store is said."""
    vehicle = file.vehicle
    parameters = ParameterServer(
        store,
        vehicle_table(vehicle),
        hull=hull_mark(vehicle, file.path.parent),
        system=vehicle.system_id,
        component=vehicle.component_id,
    )
    if parameters.trouble:
        show.say(show.words(), f"warning: {parameters.trouble}")
    return parameters
