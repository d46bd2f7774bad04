"""The doctor: checks links, clocks, disk and sensors, and in the water also thrusters and mountings.

Dry: `observe` listens to a link · `checks` judges the messages. Wet: `pulse_plan` · `motor_orders` arm, disarm, motor
tests · `pulses` run, with `motor_orders` the only I/O of the wet check · `wet_record` of it · `response` of the vehicle
to each pulse, expected and measured · `wet` thrusters and mountings · `latency` of each sensor, and all findings.
"""
