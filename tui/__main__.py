"""`python -m tui`: the `seatrial` command, where a program starts it with its own Python."""

from tui.cli import command

raise SystemExit(command())
