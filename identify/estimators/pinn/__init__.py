"""The physics-informed network: the vehicle's motion and what disturbs it as weights, under Fossen's equations.

`layout` puts a dive on the network's instants, `intervals` its readings between them. `physics` holds the balance of
momentum of the network's own state, `raw` the coefficients as they are trained, `noise` the levels beside them, and
`network` all that pulls on the weights. `equations` eliminates the weights, by `blocks`, and integrates them out.
`start` has each axis's own filter, `guide` reads it for `training`; `drag` asks what is missing, `fit` does it all,
and `answer` has `estimate`.
"""
