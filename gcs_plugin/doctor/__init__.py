"""The doctor: checks links, clocks, disk and sensors, and in the water also thrusters and mountings.

Dry: `observe` listens to a link · `checks` judges what arrived. Wet: `pulses` the pulses and how they are ordered ·
`pulse_run` sends them, the only I/O of the wet check · `wet_record` commands and readings of a recording · `response`
of the vehicle, expected and measured · `turns` the 48 ways to mistake axes · `wet` thrusters and mountings · `latency`
of each sensor, and all findings.
"""
