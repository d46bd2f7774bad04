"""Many dives: one job a recording, run here or on a Dask cluster, and what their answers tell together.

run (the whole of it), jobs (what is asked, and what came of it), work (the functions that jobs name), recordings
(DIVES to recordings), cache (what is kept), local and cluster (who does the work), parcel (a job as bytes), threads,
version; rows (the table), series and trend (mathematics), drift (words), page (the HTML report)
"""
