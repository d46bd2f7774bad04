"""How far a vehicle departs from its model now, and why. No I/O.

`model` the coefficients in force as matrices · `predictor` the model driven by recorded pulses, second by second ·
`gap` departure, noise floor, alarm · `losses` of thrusters below the floor · `forces` of the causes ·
`causes` which cause fits a departure best · `live` readings and parameters to seconds · `words` a gap in words.
"""
