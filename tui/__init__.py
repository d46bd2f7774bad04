"""The operator's faces: the `seatrial` command (cli) and what it shows."""
