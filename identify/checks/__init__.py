"""Checks of a recording against itself and its fit.

`contradictions` the list of all · `controller` used other readings than those recorded · `descent` depth against the
DVL · `heading`, `levelling` attitude against the gyro · `scales` between two sensors · `frozen`, `impossible`
readings to remove · `mends` signs, axes, units and frames that contradict physics, `pushes` by the accelerometer,
`mend` the likely mend, `alike` how they compare · `mounting` whether velocity follows thrust,
`motors` which motors it contradicts · `gaps` what a recording lacks · `fit` doubts about a fit · `lacking` doubts
that its model lacks a force.
"""
