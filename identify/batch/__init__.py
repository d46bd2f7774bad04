"""Identification, and on demand diagnosis, of many dives: jobs per recording, on this computer or on a Dask cluster,
and trends over all.

`recordings` the recordings that the command line means · `jobs` and their results, with the `code_version` that made
them · `dive_jobs` a job with a dive · `run` the batch on this computer, and results kept on disk ·
`cluster` on Dask · `rows` the table · `dive_causes` of a diagnosis · `trend` lines through values over dates · `drift`
trends of the hull, and of effects, in words · `page` the HTML report with its plots.
"""
