"""Identification and diagnosis from dives.

`run` the functions behind the verbs · `ingest` files to a dive · `checks` contradictions of a recording ·
`estimators` the methods · `effects` what a plain model leaves out · `diagnose` the gap and its causes · `repeats`
short runs of one push · `planning` the next dive · `batch` campaigns · `validation` whether the feed-forward may be
raised, and how the next dive will track · `report`, `export` pages and other simulators' files · `challenge` sealed
dives.

`dive` the dataset · `forces` its wrench, `wrench_history` at any time, `pwm_rounding` of pulses · `align` signals on
one grid, low-pass and derivatives · `gnss_fixes` surface fixes against dead reckoning · `identifiability`
coefficients that a dive can separate · `identification` the result, `doubt` about it, `nuisance` fitted with it ·
`priors` knowledge from before · `comparison` of two methods · `tracking` errors · `excitation` what a dive could
identify, `axis_span` of its thrust and speed · `thruster_allocation` gains of a vehicle's own allocation,
`given_thrust` what thrusters gave · `statistics` figures of samples · `threads` on all processors · `progress` of
long work · `words` numbers and lists for readers.
"""
