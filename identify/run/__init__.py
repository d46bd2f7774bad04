"""The functions behind the verbs, with typed steps and results.

`identify` · `diagnose` · `validate` · `plan` · `recordings` how all of them read dives · `joined_runs` several runs as
one dive · `in_force` the model that a dive flew with · `repeats` short runs of one push, judged by accepted ones ·
`vehicle_of_log` the vehicle of a log.
"""
