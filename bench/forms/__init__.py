"""Other forms of a physics-informed network than `identify.estimators.pinn`, each as good as we could make it.

`task` prepares a mission for them; `physics` holds the loss terms that they share, `disturbance` the disturbance and
its prior, `integration` integrates the equations, `waves` is a network of time, `training` trains. `lstm`,
`neural_ode`, `shooting` and `strong` are the forms. `left_out` computes the bias that they share. `judge`, `reasons`
and `page` make the record.
"""
