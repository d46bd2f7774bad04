"""The user interfaces: the `seatrial` command (cli) and its output."""
