"""Reads recordings into dives.

`open` chooses the reader · `tlog`, `dataflash` read what vehicles record · `streams` the form of every other file,
which `ulog`, `arrays`, `matlab`, `parquet` and `ros` read, with libraries that `extras` finds · `table` a dive from
streams by a column map · `logs` adds an autopilot's own log · `frames` decodes MAVLink by message id · `messages`
one vehicle's messages on its boot clock · `runs` the run of a recording with restarts · `commands` thrust that is not
known · `rotation` attitude and axes.
"""
