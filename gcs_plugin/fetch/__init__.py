"""Fetching: what the vehicle kept of a dive and the ground never heard, over the same link."""
