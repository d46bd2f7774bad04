"""Reads recordings into dives: `open` chooses the reader; `tlog`, `dataflash` and `table` each read one format.

`frames` decodes MAVLink by message id, `messages` selects the vehicle's own messages and puts them on its boot clock,
`rotation` turns vectors between axes, `gaps` lists what a recording lacks.
"""
