"""Dives with hidden effects, locked answers, and the score of those who named them.

The simulator here is written anew: it shares no equation with `bridge.vehicle.dynamics`, `bridge.effects` or
`bridge.simulator`, and what it hides has other forms than those that the library of effects fits. Only its
size is told in the library's words (`nearest`).
"""
