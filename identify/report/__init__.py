"""The HTML report, one self-contained page: `page` writes it, `sections` builds its parts.

theme (style sheet), text (escaping, numbers), decimate, axes, plot, figures, track, tracking, whiteness,
tables, nuisance, diagnosis, diagnosis_figures, heatmap, bars
"""
