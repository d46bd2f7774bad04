"""What an operator sees of a vehicle now: frames -> `Picture`. No I/O, and time is an argument.

`picture` defines the types; `freshness` ages; `traces` holds the last minute; `hearing` maps messages to signals,
ArduSub's included; `sensors` judges them; `words` reads STATUSTEXT, `links` the senders; `watcher` combines all.
"""
