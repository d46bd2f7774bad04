"""The Cramer-Rao bound of a mission: `cramer_rao(mission)`, the least relative error that any method can have.

`bound` sets it up and inverts, `kernel` runs the joint filter and its sensitivities. No code here is shared with the
estimators that are judged by it.
"""
