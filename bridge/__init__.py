"""The vehicle: what it is, what it says, and what it does with its parameters. Runs on a Raspberry Pi.

vehicle: configuration, dynamics, thrusters, controller, feed-forward. sensors: bytes to samples.
messages, framing, tlog, link: the wire. parameters: the vehicle's own store. service: ports to samples
to frames to links. simulator: the simulated vehicle that stands in for the sea.
"""
