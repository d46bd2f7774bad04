"""Sensors against each other.

`descent` depth against the DVL · `heading`, `levelling` attitude against the gyro · `scales` between two sensors ·
`sensor_pairs` that see one motion, and how alike they move.
"""
