"""The HTML report, a single self-contained page.

Pages: `identification` · `diagnosis` with `diagnosis_figures` · `validation`. Parts: `page` the page, its style, its
figures as files, its provenance · `tables` and `figures` of an identification and a dive · `traces` curves to zoom ·
`cells` of tables, and tables as CSV.
Drawing: `plot` with matplotlib · `picture` SVG for the page, files for a paper.
"""
