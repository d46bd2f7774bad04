"""Forms of a physics-informed network that lost to `identify.estimators.pinn`, each as good as we could make it.

`task` lays a mission out for them, `physics` holds what pulls on all of them, `integration` runs the equations
forward, `training` trains; `lstm`, `neural_ode`, `shooting` and `strong` are the forms, `judge` and `page` the record.
"""
