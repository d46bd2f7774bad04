"""The identified model as files for other simulators, and a dive for programs that plot it.

`model` all known dynamics, axes, XML · `targets` the simulators, and what each can't hold · `gazebo`, `stonefish`,
`ardusub_json` their files · `mcap` the file of a dive as topics with units in their names, with the model's velocities
along it.
"""
