"""Dive folders.

`folder` names, `dive.yaml`, the folders of a place, in the order of their start · `conditions` water, tether, ballast ·
`replay` a recording in its own timing · `recorded` the folders of a recording that goes on from dive to dive.
"""
