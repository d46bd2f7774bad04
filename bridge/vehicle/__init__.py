"""The vehicle model and its control.

`config` the vehicle file · `coefficients` names, units and bounds of those of the model and of effects beyond it ·
`parameters` the table of both, and its checksum · `dynamics` Fossen's equations · `thrusters` PWM to thrust and back ·
`navigation` the state from samples · `references` speed profiles · `legs` of a mission · `controller` the PID · `mode`
of the feed-forward · `feedforward` the model's part of the thrust · `accepted_effects` losses of thrusters, a falling
supply · `shadow` judges the feed-forward before it acts · `in_force` all that is known of the set in force ·
`autopilot` one control tick · `forecast` of the errors of
the next dive, gains credited to thrusters.
"""
