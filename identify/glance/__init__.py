"""What is told of a recording before anyone fits anything: how much of it is missing, what it could identify."""
