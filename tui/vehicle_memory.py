"""A vehicle's own parameters, kept in a file: the bridge and the simulated vehicle start with them."""

from pathlib import Path

from bridge.parameters import ParameterServer, vehicle_table
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.hull import hull_mark
from tui import show


def server(file: VehicleFile, store: Path | None) -> ParameterServer:
    """Make the parameter server of a vehicle file, stored in `store`, or only in memory if that is None. A problem
    with the store is reported."""
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
