"""Sensors against each other.

`descent` depth against the DVL · `heading`, `levelling` attitude against the gyro · `scale` between two sensors, over
`windows` of the dive · `sensor_pairs` that see one motion, and how alike they move.
"""
