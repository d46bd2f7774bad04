"""Flying a plan, from the ground: it asks, watches and ends; the vehicle holds the manoeuvre and its limits.

`plan` the manoeuvres of a file · `session` what is sent and heard, pure · `crew` a session on a recorded link.
"""
