"""How far the gap shrinks with the causes.

`shrink` the measure, of drifts in windows · `held_out` on pieces of the dive · `check_dive` on a further dive, and
its `contradiction` · `shrunk` the types, which a screen shows without loading the mathematics.
"""
