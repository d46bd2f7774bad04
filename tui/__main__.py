"""`python -m tui`: the `seatrial` command, for programs that start it with their own Python."""

from tui.cli import command

raise SystemExit(command())
