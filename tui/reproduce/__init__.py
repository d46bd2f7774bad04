"""The source paper's tables and figures beside those of the simulated vehicle, on one page.

published (the paper's numbers), arithmetic and points (where they do not fit together), campaigns and trials
(the dives), measures and coupling (what is read off them), run (all of it), figures, sections, page, results (JSON)
"""
