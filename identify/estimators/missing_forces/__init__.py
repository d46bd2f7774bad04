"""Forces that a fit's model lacks, and how far they move the coefficients.

`drag_and_timing` quadratic drag, thrust at another time · `screening` all other forces, of the kinds in `forms` ·
`spectral_peak` as of waves.
"""
