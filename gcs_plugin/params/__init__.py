"""Parameters: files and their sidecars, the plan, transfer and upload (pure), the client (thin I/O)."""
