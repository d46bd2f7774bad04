"""What an operator sees now: frames -> `Picture`. Pure: no I/O, and time is an argument.

`picture` the types; `freshness` how old is too old; `traces` the last minute; `hearing` which message tells a signal,
ArduSub's too; `sensors` what is bad about it; `words` STATUSTEXT, `links` who speaks; `watcher` puts it together.
"""
