"""Writes the identified model as files for other simulators."""
