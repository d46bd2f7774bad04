"""Reads recordings into dives.

`open` chooses the reader · `same_dive` recordings of one dive, by their bytes · `tlog`, `dataflash` read MAVLink ·
`streams` the form of every other file before its column map: `text_table`, `parquet`, `arrays`, `matlab`, `ulog` and
`ros` read it, with libraries by `extras` · `column_map` the map · `signals` a dive of streams by the map · `run_column`
runs in one table · `clock` dates and whole seconds · `names`, `ranges`, `candidates` meanings of a column · `units` ·
`profiles`, `proposal`, `proposal_of_runs`, `map_text` a proposed map · `autopilot_log` adds an autopilot's own log to a
dive, `turns` on its clock · `low_pass` takes off its filters, `held_pressure`, `step_velocity` date its pressure and
its DVL · `frames` decodes MAVLink by message id · `messages` one vehicle's messages on its boot clock · `runs` the run
of a recording with restarts · `commands` thrust that is not known · `effort` commands from -1 to 1 · `slow_pulses`
pulses between slow samples · `heading_resets` a heading that is set anew · `rotation` attitude and axes ·
`autopilot_parameters` the autopilot's parameters in a log.
"""
