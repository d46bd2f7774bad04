"""A mutation run: small changes to the code, drawn by chance, and whether a test fails of each.

`changes` finds and draws them, `nearest_tests` says which tests could notice one, `trials` runs these on a copy of the
tree, `section` writes the page.
"""
