"""Fetches the parts of a dive that the vehicle recorded and the ground never heard, over the same link.

`requests` MAVLink FTP over a bad link · `fetching` list, bytes and checksum of segments · `mirror` the ground's copy
of the ring · `clock_alignment` a recording put on another's clock · `merge_order` order of merged frames, and gaps ·
`merging` the complete recording · `into_dive` which segments belong to a dive, and its folder.
"""
