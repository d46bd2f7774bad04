"""Simulated missions that nothing was tuned on: `draw_one(seed)` gives a vehicle, a dive and the truth behind it.

`vehicles` draws a vehicle, `sensors` its sensors, `manoeuvres` its reference, `kernel` dives it under feedback,
`mission` puts the four together as a `Mission`.
"""
