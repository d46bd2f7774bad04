"""Readings to leave out (`copies`, `frozen`, `impossible`, `still_gyro`), and what is told of a
recording: `missing_signals`, `flipping_commands`."""
