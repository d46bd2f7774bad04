"""Readings to leave out (`copies`, `frozen`, `impossible`), and `missing_signals`."""
