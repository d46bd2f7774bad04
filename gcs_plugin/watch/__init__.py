"""The present state of a vehicle for its operator: frames -> `Picture`. Time is an argument, and there is no I/O but
for the recording of a dive that is under way already.

`channels` messages as signals, ArduSub's included, and STATUSTEXT · `sensors` the table of sensors, judged · `traces`
of the last minute, `trace_ring` holds one · `thruster_rows` · `link_rows` senders and their losses · `picture` the
types, and how old a value may be · `alarms` limits, which of them are passed, and the words left of alarms · `past_gap`
the gap monitor of a dive under way · `watcher` combines all.
"""
