"""Readings to leave out (`copies`, `frozen`, `impossible`), and what is told of a
recording: `missing_signals`, `flipping_commands`."""
