"""What the program knows of an autopilot's firmware; what flies beside it is in a folder of its own.

`description` all that is known of one · `ardusub` ArduSub's · `table` those that are supported, and what works with
others · `rates` asks for its messages · `questions` asks for its parameters.
"""
