"""Facts of an autopilot's firmware; the program that flies beside it is in a folder of its own.

`description` all that is known of one · `ardusub` ArduSub's · `table` those that are supported, and verbs for
others · `rates` asks for its messages · `questions` asks for its parameters.
"""
