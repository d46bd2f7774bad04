"""The gap: `simulation` of the model along the dive, its `drift` with floor and plain baseline, the `missing` force,
and all of it `measured` with an explanation.
"""
