"""Identification and diagnosis from dives.

`run` the functions behind the verbs · `ingest` files to a dive · `thrust` its wrench · `checks` contradictions of a
recording · `estimators` the methods · `effects` what a plain model leaves out · `diagnose` the gap and its causes ·
`repeats` short runs of one push · `planning` the next dive · `batch` campaigns · `validation` tracking errors, whether
the feed-forward may be raised, and how the next dive will track · `report`, `export` pages and files of other
simulators · `challenge` sealed dives.

`dive` the dataset · `align` signals on one grid, low-pass and derivatives · `gnss_fixes` surface fixes against dead
reckoning · `identification` the result, `doubt` about it, `nuisance` fitted with it · `priors` knowledge from before ·
`axis_span` of a dive's thrust and speed · `statistics` figures of samples · `threads` on all processors · `progress` of
work · `words` and numbers for readers.
"""
