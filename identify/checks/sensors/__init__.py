"""Sensors against each other.

`descent`, `descent_timing` depth against the DVL · `heading`, `levelling` attitude against the gyro · `scale` between
two sensors, over `windows` of the dive · `sensor_pairs` that see one motion, and how alike they move.
"""
