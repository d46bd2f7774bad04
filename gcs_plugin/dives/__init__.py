"""Dive folders.

`folder` names, `dive.yaml`, the folders of a place · `order` recordings and lengths of dives, in order · `conditions`
water, tether, ballast · `replay` a recording in its own timing.
"""
