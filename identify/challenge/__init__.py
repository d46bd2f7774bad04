"""Simulated dives with hidden effects, their locked answers, and the score of a diagnosis that names the effects.

`vehicles`, `sensors` a drawn vehicle · `scenario` the vehicle in its water · `mission` its way · `hull`,
`equations_of_motion`, `dive`, `simulate` the simulator · `planted_effects` that a diagnosis must name · `novel_effects`
that no library has · `nearest_parameters` size of both in the library's parameters · `case` dives and their truth ·
`tlog` a dive as a recording · `seal` writes dives and locked answers · `answer` of a diagnosis · `indistinguishable`
causes that count as the same · `score` rates with intervals.

The simulator is independent: it shares no equation with `bridge.vehicle.dynamics`, `identify.effects` or
`bridge.simulator`, and its hidden effects have other forms than those that the library of effects fits.
"""
