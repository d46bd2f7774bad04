"""The compiled Kalman filter of one degree of freedom.

`state` its model, a step and an update · `transitions` the table of its steps · `innovations` a pass over the events ·
`information` a pass for the likelihood's gradient and information.
"""
