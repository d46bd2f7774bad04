"""Simulated dives with hidden effects, their locked answers, and the score of a diagnosis that names the effects.

The simulator is independent: it shares no equation with `bridge.vehicle.dynamics`, `identify.effects` or
`bridge.simulator`, and its hidden effects have other forms than those that the library of effects fits. Only their
size is expressed in the library's parameters (`nearest`).
"""
