"""Methods of identification: each turns a Dive into an Identification.

`table` their names. Equations: `axes` a dive for the filters · `events` its readings in order · `afloat` its ends at
the surface · `readings` channels · `motion` velocities and Coriolis forces · `lateness` forces at another time ·
`innovations` the compiled filter · `information` its gradient. Fit:
`likelihood` the method · `likelihood_axis`, `likelihood_joint`, `likelihood_fit` of one axis, of all, and its summit ·
`start` a rough fit of all · `scoring` the climb · `intervals` beyond the parabola · `drag_and_timing` that the model
lacks · `unmodelled` other forces that it lacks, `forms` of them, `spectral_peak` as of waves · `mass_by_run` runs of
two vehicles · `thrust_delay` · `autopilot_velocity` how late it is · `pinn` the network.

`refusals` dives that no method can identify · `answer` a fit as a user's answer.
"""
