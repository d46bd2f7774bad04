"""Checks of a recording against itself and its fit.

`contradictions` the list of those that identification and diagnosis share · `readings` to leave out · `sensors` against
each other · `actuation` control and thrust against the motion · `mapping` columns mapped for the first time · `fit`.
"""
