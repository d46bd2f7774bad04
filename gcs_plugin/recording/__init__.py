"""Recording: links to files, the hub for other programs, and the state that they read."""
