"""One file a verb of the `seatrial` command.

Each module has EXAMPLE (a command line for its help), `add_arguments(parser)` and
`run(arguments) -> exit code`. Only the module of the verb asked for is imported, and it imports what it works
with inside `run`, so that help appears at once.
"""
