"""Two runs of a vehicle in Fossen's PythonVehicleSimulator: find the effect that is in only one of them."""
