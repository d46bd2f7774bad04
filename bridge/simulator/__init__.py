"""The simulated vehicle: it stands in for the sea, and speaks in the bytes of the real sensors.

`truth` what the vehicle really is · `plant` the body, `kernel` its compiled inner loop · `missions` what it
is asked to dive · `devices` plant to bytes · `dive` the whole chain in lock-step, or in real time.
Nothing outside imports it at start-up: numba takes a second to load.
"""
