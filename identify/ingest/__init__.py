"""Reads recordings into dives.

`open` chooses the reader · `tlog`, `dataflash`, `table` each read one format · `streams` the form of every foreign
file before its column map · `names`, `ranges` what a column may be · `mapped` signals of streams by a map ·
`profiles`, `proposal`, `map_text` a proposed map · `logs` adds an autopilot's own log · `frames` decodes MAVLink by
message id · `messages` one vehicle's messages on its boot clock · `runs` the run of a recording with restarts ·
`commands` thrust that is not known · `rotation` attitude and axes.
"""
