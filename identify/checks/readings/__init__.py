"""Readings to leave out (`copies`, `frozen`, `impossible`, `smoothed_gyro`, `still_gyro`), and what is told of a
recording: `missing_signals`, `flipping_commands`."""
