"""The source paper's tables and figures next to those of the simulated vehicle, on one page.

published (the paper's numbers), arithmetic and points (contradictions in them), campaigns and trials (the dives),
measures and coupling (evaluation of the dives), run (all of it), figures, sections, page, results (JSON)
"""
