"""The physics-informed network: the vehicle's motion and its disturbance as weights, under Fossen's equations.

`layout` puts a dive on the network's instants, `intervals` its readings between them. `physics` holds the momentum
balance of the network's own state, `raw` the coefficients as they are trained, `noise` the noise levels, `network`
all residuals of the weights, and `leaning` their slopes in the coefficients. `equations` eliminates the weights, by
`blocks`, and integrates them out; `stretches` divides that work among cores. `start` has each axis's own filter, and
`guide` reads it for `training`. `fit` runs the whole, and `answer` has `estimate`.
"""
