"""Recordings into dives: `open` chooses the reader; `tlog`, `dataflash` and `table` read one form each.

`frames` decodes MAVLink by message id, `messages` picks the vehicle's own and puts them on its boot clock,
`rotation` turns vectors between axes, `gaps` says what a recording lacks.
"""
