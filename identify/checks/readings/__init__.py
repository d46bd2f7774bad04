"""Readings to leave out (`frozen`, `impossible`), and `missing_signals`."""
