"""Reads recordings into dives.

`open` chooses the reader · `mavlink` recordings of telemetry and logs of autopilots · `files` every other file, and
`ros` bags, as streams of named numbers · `mapping` which column is which signal · `same_dive` one dive twice, by their
bytes · `runs` the run of a recording with restarts · `commands` of thrusters that are unknown, or no pulses ·
`slow_pulses` pulses between slow samples · `rotation` attitude and axes · `lever_arm` a velocity at the DVL's place.
"""
