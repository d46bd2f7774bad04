"""Identification of many dives: a job per recording, on this computer or on a Dask cluster, and trends over all.

`recordings` the recordings that the command line means · `jobs` jobs, results, the version that made them · `work` the
function that jobs name · `run` the batch on this computer, and results kept on disk · `cluster` on Dask · `rows` the
table · `trend` lines through values over dates · `drift` trends in words · `page` the HTML report.
"""
