"""Other forms of a physics-informed network than `identify.estimators.pinn`, each as good as we could make it.

`task` lays a mission out for them, `physics` holds what pulls on all of them, `disturbance` its prior, `integration`
runs the equations forward, `waves` is a network of time, `training` trains; `lstm`, `neural_ode`, `shooting` and
`strong` are the forms, `left_out` is what all of them leave out; `judge`, `reasons` and `page` are the record.
"""
