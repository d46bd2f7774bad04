"""The HTML report, a single self-contained page.

Pages: `identification` · `diagnosis` with `diagnosis_figures` · `validation`. Parts: `page` the page and its provenance
· `sections` · `tables` · `figures` · `traces` curves to zoom · `tracking` errors and curves against a reference.
Drawing: `plot` with matplotlib · `picture` SVG for the page, files for a paper.
"""
