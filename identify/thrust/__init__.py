"""The thrust of a dive: from the thrusters' commands to the wrench on the vehicle.

`wrench` of a dive, `wrench_history` at any time · `shafts` that lag in speed · `pwm_rounding` of pulses ·
`thruster_allocation` gains of a vehicle's own allocation · `given_thrust` of each thruster, by how the vehicle moved.
"""
