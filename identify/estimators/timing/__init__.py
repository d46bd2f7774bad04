"""Thrust and velocities that come late.

`lateness` how a force changes with the time at which it acts · `thrust_delay` fitted · `autopilot_velocity` how late
and how smooth an autopilot's own velocity is.
"""
