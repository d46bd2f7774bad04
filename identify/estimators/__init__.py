"""Methods of identification: each turns a Dive into an Identification.

`table` their names · `axes` a dive for the filters · `filter` the compiled Kalman filter · `likelihood` the method of
maximum likelihood · `missing_forces` that a fit's model lacks · `timing` thrust and velocities that come late ·
`pinn` the network.

`refusals` dives that no method can identify · `answer` a fit as a user's answer · `identifiability` coefficients that a
dive can separate · `mass_by_run` runs of two vehicles · `excitation` what a dive could identify, before any fit ·
`comparison` of two methods.
"""
