"""Checks of a recording against itself and its fit.

`contradictions` the list of all · `controller` used other readings than those recorded · `descent` depth against the
DVL · `heading`, `levelling` attitude against the gyro · `scales` between two sensors · `frozen`, `impossible`
readings to remove · `first_mapping` signs, axes, units and frames that contradict physics, `acceleration` those of the
velocity, `wrench_frame` of a wrench, `mend` the likely mend, `correlation` of two signals, `sensor_pairs` that see one
motion · `thrust_response` whether velocity follows thrust, `motors` which motors it contradicts · `missing_signals`
of a recording · `fit` doubts about a fit · `unmodelled` doubts about a model that lacks a force.
"""
