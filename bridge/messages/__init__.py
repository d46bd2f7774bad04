"""The telemetry contract, version 1: what a vehicle says, as MAVLink and back.

`readings` one table of signals, encode beside decode; `compose` samples and control ticks to readings.
"""
