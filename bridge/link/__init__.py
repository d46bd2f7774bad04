"""Links that carry bytes: serial, UDP, TCP, memory, and a lossy one with switches. See `base.Link`."""
