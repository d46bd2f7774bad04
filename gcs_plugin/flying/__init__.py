"""Flying a plan, from the ground: it asks, watches and ends; the vehicle holds the manoeuvre and its limits.

`plan` the manoeuvres of a file · `session` messages and the vehicle's answers, pure · `crew` a session on a recorded
link · `run` which piece is next, and when to stop.
"""
