"""The nominal model fitted to a dive, and what its filters and other sensors show, as one regression.

`judged_axes`, `slow_samples` what is fitted · `nominal` the fit · `predicted` motion by the filters · `innovations`
and `witnesses`, what filters and other sensors show · `deviation` of a compass · `backwards` what each instant of a
force changes · `regression` the dive as linear equations.
"""
