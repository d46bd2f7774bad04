"""Thrust and velocities that come late.

`lateness` how a force changes with the time at which it acts · `thrust_delay` fitted · `thrust_timing` a delay, or a
lag of the shafts · `sampled_commands` commands of a faster loop · `autopilot_velocity` how late and how smooth an
autopilot's own velocity is.
"""
