"""Reads recordings into dives.

`open` chooses the reader · `tlog`, `dataflash` read MAVLink · `text_table` the rows of a table of text · `clock` dates
and whole seconds · `streams` the form of every foreign file before its column map · `table` the map · `mapped` signals
of streams by a map · `names`, `ranges` what a column may be · `profiles`, `proposal`, `map_text` a proposed map ·
`logs` adds an autopilot's own log · `frames` decodes MAVLink by message id · `messages` one vehicle's messages on its
boot clock · `runs` the run of a recording with restarts · `commands` thrust that is not known · `effort` commands from
-1 to 1 · `rotation` attitude and axes.
"""
