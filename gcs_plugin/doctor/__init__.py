"""The doctor: checks links, clocks, disk and sensors, and in the water also thrusters and mountings.

`findings` defines its results; `observe` listens to a link; `checks` judges what arrived, `identity` which vehicle
sent it; `wet_record`, `pulses`, `response`, `turns`, `wet`, `latency` make the wet check, without I/O except for
`pulse_run`, which sends the orders to the vehicle.
"""
