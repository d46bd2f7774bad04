"""The doctor: findings on links, clocks, disk and sensors; in the water, on thrusters and mountings.

`findings` what it says; `observe` listens; `checks` judges what was heard, `identity` of whom; `wet_record`, `pulses`,
`response`, `turns`, `wet`, `latency` are the wet doctor's, pure but for `pulse_run`, which asks the vehicle
for the pulses.
"""
