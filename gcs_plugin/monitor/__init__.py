"""How far a vehicle departs from its model now, and why. No I/O.

`model` the coefficients in force as matrices · `predictor` the model driven by recorded pulses and by the forces of
causes, second by second · `gap` departure, noise floor, alarm, and all that in words · `losses` of thrusters below the
floor · `causes` which cause fits a departure best · `live` readings and parameters to seconds.
"""
