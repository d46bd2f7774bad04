"""How near to the truth each method comes.

`section` errors over their Cramer-Rao bounds, of `trials`, by `tally` · `answers` of the methods as
plain data · `coverage` of 95 % intervals, `pooled` over groups · `shorter_recordings` with less data ·
`prediction` of unseen dives.
"""
