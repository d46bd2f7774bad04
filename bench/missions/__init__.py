"""Simulated missions that nothing was tuned on: `draw(seeds)` gives vehicles, dives and the truth behind them.

`vehicles` draws a vehicle, `sensors` its sensors, `manoeuvres` its reference, `kernel` dives it under feedback,
`mission` puts the four together as a `Mission`.
"""

from bench.missions.mission import Mission, draw

__all__ = ["Mission", "draw"]
