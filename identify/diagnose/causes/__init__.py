"""The search for causes: candidates, the nats that they save and must save, and the confidence in them.

`candidates` the library's causes, `seas` with their periods · `evidence`, `weighing`, `ranking` the nats that each
saves, and `requirement` must save · `selection` one step, `search` to the end · `shafts` beside which lag · `onset`
causes that begin or pass within the dive · `confidence` intervals and presence · `form_remainder` of inexact forms ·
`ambiguity` causes alike.
"""
