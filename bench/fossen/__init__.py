"""Two runs of a vehicle in Fossen's PythonVehicleSimulator: what does the one hold that the other does not?"""
