"""Quick looks at a recording before any fit: how much of it is missing, and what it could identify."""
