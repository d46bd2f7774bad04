"""Identification of many dives: one job per recording, run on this computer or on a Dask cluster, and trends over all.

run (the batch as a whole), jobs (jobs and their results), work (the functions that jobs name), recordings (turns
DIVES of the command line into recordings), cache (results kept on disk), local and cluster (run the jobs), parcel (a
job as bytes), threads, version; rows (the table), series and trend (mathematics), drift (trends in words), page (the
HTML report)
"""
