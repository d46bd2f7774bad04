"""The physics-informed network: the vehicle's motion and its disturbance as weights, under Fossen's equations.

`layout` a dive on the network's instants, and the equations over each interval · `network` weights, residuals, their
linear algebra · `parameters` coefficients, noise levels · `equations` the weights eliminated ·
`training` the fit · `answer` the result.
"""
