"""The simulated vehicle: replaces the sea and speaks in the bytes of the real sensors.

`truth` what is true of the vehicle and its sensors · `plant` the body and its compiled inner loop · `onset` effects
that set in during a dive · `missions` the missions to dive · `devices` motion to bytes · `body` plant and devices ·
`dive` the whole chain in lock-step · `direct` without any bytes · `json_plant` the body under ArduSub's own simulator ·
`served` its devices for another program to read.
No other package imports it at start-up: numba takes a second to load.
"""
