"""Methods of identification: each turns a Dive into an Identification.

`table` their names. Equations: `axes` a dive for the filters · `readings` channels · `motion` velocities and Coriolis
forces · `lateness` forces at another time · `innovations` the compiled filter · `information` its gradient. Fit:
`likelihood` the method · `likelihood_axis`, `likelihood_joint`, `likelihood_fit` of one axis, of all, and its summit ·
`scoring` the climb · `intervals` beyond the parabola · `misfit` forces that the model lacks · `timing` delay of thrust
and of velocity · `pinn` the network.

`refusals` dives that no method can identify · `answer` a fit as a user's answer.
"""
