"""Simulated dives with hidden effects, their locked answers, and the score of a diagnosis that names the effects.

`vehicles`, `site` a drawn vehicle in its water · `mission` · `hull`, `world`, `dive`, `simulate` the simulator ·
`plants` effects that a diagnosis must name · `plants_novel` effects that no library has · `nearest` their size in the
library's parameters · `case` dives and their truth · `seal` writes them locked · `score` rates with intervals.

The simulator is independent: it shares no equation with `bridge.vehicle.dynamics`, `identify.effects` or
`bridge.simulator`, and its hidden effects have other forms than those that the library of effects fits.
"""
