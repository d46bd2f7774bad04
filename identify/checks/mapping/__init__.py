"""Columns whose sign, axis, unit or frame contradicts physics, for a log that is mapped for the first time.

`first_mapping` the list of all, each with its likely `mend` · `frames` axes of the velocity and of a recorded wrench.
"""
