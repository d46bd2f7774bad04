"""A dive for the filters: of each degree of freedom its readings in time order, and the forces between them.

`build` the axes of a dive · `axis` their data · `readings` channels · `events` readings in order · `forces` thrust and
Coriolis forces by step · `motion` smoothed velocities · `afloat` ends at the surface · `another_vehicle` whose dive it
can hardly be.
"""
