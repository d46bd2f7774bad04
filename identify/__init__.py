"""Identification and diagnosis from dives.

`run` the functions behind the verbs · `ingest` files to a dive · `checks` contradictions of a recording · `estimators`
the methods · `effects` what a plain model leaves out · `diagnose` the gap and its causes · `repeats` short runs of one
push · `planning` the next dive · `batch` campaigns · `glance` quick looks · `report`, `export` pages and other
simulators' files · `challenge` sealed dives.

`dive` the dataset · `forces` its wrench, `wrench_history` at any time, `rounding` of pulses · `align` signals on one
grid, low-pass and derivatives · `fixes` surface fixes against dead reckoning · `identifiability` coefficients that a
dive can separate · `identification` the result, `doubt` about it, `nuisance` fitted with it · `priors` knowledge from
before · `comparison` of two methods · `tracking` errors · `foretell` those of the next dive · `allocated` gains of a
vehicle's own allocation, `given_thrust` what thrusters gave · `statistics` figures of samples · `threads` on all
processors · `progress` of long work · `words` numbers and lists for readers.
"""
