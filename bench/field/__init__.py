"""Dives as a stock autopilot records them, each with a drawn vehicle, filter and sea: made, diagnosed and judged.

`vehicle`, `autopilot`, `mission` the diver, and how a pilot flies it · `scenario` the vehicle in its water ·
`planted_effects` that it may hide · `dive`, `simulate` the simulator · `draw` all of these for a seed · `export` the
dive as a recording · `answers` of `seatrial diagnose` · `score` of these · `regressions` other methods, to compare ·
`section`, `ground_station` the pages.
"""
