"""Links that carry bytes: serial, UDP, TCP, memory, and a lossy link with switches. See `base.Link`."""
