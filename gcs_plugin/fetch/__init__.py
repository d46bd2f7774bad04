"""Fetch the parts of a dive that the vehicle recorded and the ground never heard, over the same link."""
