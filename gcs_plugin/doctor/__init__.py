"""The doctor: checks links, clocks, disk and sensors, and in the water also thrusters and mountings.

Dry: `observe` listens to a link · `checks` judges what arrived. Wet: `pulses` planned, ordered and run, the only I/O of
the wet check · `response` of the vehicle in a recording, expected and measured · `wet` thrusters and mountings ·
`latency` of each sensor, and all findings.
"""
