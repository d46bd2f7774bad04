"""The HTML report, a single self-contained page: `page` writes it, `sections` builds its parts.

theme (colours, style sheet), text (escaping, numbers), plot, picture, figures, track, tracking, whiteness, tables,
nuisance, diagnosis, diagnosis_figures, heatmap, bars, validation, grouped, provenance, paper
"""
