"""Parameters: files and their sidecar, the plan, transfer and upload (pure), the client (thin I/O)."""
