"""Methods of identification: each turns a Dive into an Identification.

`table` their names. Equations: `axes` a dive for the filters · `events` its readings in order · `afloat` its ends at
the surface · `readings` channels · `motion` velocities and Coriolis forces · `lateness` forces at another time ·
`innovations` the compiled filter · `information` its gradient. Fit:
`likelihood` the method · `likelihood_axis`, `likelihood_joint`, `likelihood_fit` of one axis, of all, and its summit ·
`start` a rough fit of all · `scoring` the climb · `intervals` beyond the parabola · `misfit` drag and timing that the
model lacks · `alike_runs` runs of two vehicles · `lacking` other forces that it lacks, `forms` of them, `swing` as of
waves · `timing` delay of thrust and of velocity · `pinn` the network.

`refusals` dives that no method can identify · `answer` a fit as a user's answer.
"""
