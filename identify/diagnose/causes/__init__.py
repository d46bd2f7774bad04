"""The search for causes: candidates, the nats that they save and must save, and the confidence in them.

`candidates` what is tried, `seas` with their periods · `evidence`, `weighing`, `ranking` what each saves ·
`requirement` what it must save · `selection` one step, `search` to the end · `shafts` beside which lag · `onset` what
begins within the dive · `confidence` intervals and presence · `form_remainder` what inexact forms leave · `ambiguity`
causes alike.
"""
