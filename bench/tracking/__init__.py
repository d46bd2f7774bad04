"""How well the simulated vehicle follows its references.

`section`, `steady` errors, `ladder` of PID and feed-forward.
"""
