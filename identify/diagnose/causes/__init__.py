"""The search for causes: what is tried, what it saves, what it must save, and how sure that is.

`candidates` what is tried, `seas` with their periods · `evidence`, `weighing`, `ranking` what each saves ·
`requirement` what it must save · `selection` one step, `search` to the end · `shafts` beside which lag ·
`confidence` intervals and presence · `form_remainder` what inexact forms leave · `ambiguity` causes alike.
"""
