"""The source paper's method, and its tables and figures next to those of the simulated vehicle, on one page.

paper (its method), published (its numbers), points (contradictions in them), dives, measures, comparisons, run, page.
"""
