"""The simulated vehicle: it stands in for the sea, and speaks in the bytes of the real sensors.

`truth` what the vehicle really is · `plant` the body, `kernel` its compiled inner loop · `missions` what it is asked
to dive · `devices`, `ancillary` motion to bytes, `instruments` all of them · `body` plant and instruments · `dive` the
whole chain in lock-step · `terminals` the same in real time over pseudo-terminals · `direct` without any bytes.
Nothing outside imports it at start-up: numba takes a second to load.
"""
