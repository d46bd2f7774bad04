"""Measurements that take too long for a test. `python -m bench` runs them and writes docs/benchmarks.md.

`sections` the list of all · `document` the page, `words` its Markdown · `remembered` results kept, under a `stamp` of
their code · `campaigns` dives of the source paper's vehicle · `paper_network` its network in full size.
"""
