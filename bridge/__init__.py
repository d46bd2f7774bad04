"""The vehicle: its configuration, its telemetry and its handling of parameters. Runs on a Raspberry Pi.

vehicle: configuration, dynamics, thrusters, controller, feed-forward. sensors: bytes to samples. messages, framing,
tlog, link: the wire. parameters: the vehicle's own store. service: ports to samples to frames to links. simulator:
the simulated vehicle that stands in for the sea.
"""
