"""Effects that a plain diagonal model leaves out: a diagnosis tests for them, and a simulator can plant them.

`effect` definition · `course` the motion that effects depend on · `library` all of them: `hydrodynamics` hull ·
`rigid_body` mass and balance · `environment` moving water, walls, tether · `actuators`, `supply`, `wake` thrust ·
`sensors` readings.
"""
