"""The simulated vehicle: replaces the sea and speaks in the bytes of the real sensors.

`truth` true parameters of the vehicle · `plant` the body, `kernel` its compiled inner loop · `missions` the missions
to dive · `world` noise and water, `devices` motion to bytes · `body` plant and devices · `dive` the whole chain in
lock-step · `direct` without any bytes. No other package
imports it at start-up: numba takes a second to load.
"""
