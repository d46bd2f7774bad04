"""The identified model as files for other simulators.

`model` all known dynamics, axes, XML · `targets` the simulators, and what each can't hold · `gazebo`, `stonefish`,
`ardusub_json` their files.
"""
