"""Identification of many dives: a job per recording, on this computer or on a Dask cluster, and trends over all.

`run` the batch, and results kept on disk · `recordings` the recordings that the command line means · `jobs` jobs,
results, the version that made them · `work` the functions that jobs name · `local`, `cluster` run the jobs · `rows` the
table · `trend` lines through values over dates · `drift` trends in words · `page` the HTML report.
"""
