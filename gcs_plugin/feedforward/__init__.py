"""The feed-forward of vehicles, switched from the ground.

`switch` of all vehicles, `switched_vehicle` of one · `off_orders` the marks of OFF orders on this computer.
"""
