"""Dive folders: what is in them, their order and length, conditions, replay."""
