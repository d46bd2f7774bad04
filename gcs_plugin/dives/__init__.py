"""Dive folders.

`folder` names, `dive.yaml`, the folders of a place, in the order of their start · `recordings` in a folder, when they
begin and how long they are · `conditions` water, tether, ballast · `replay` a recording in its own timing ·
`recorded_dives` the folders of the dives while they are recorded, one after the other.
"""
