"""The verbs of the command seatrial, a module for each.

Each module has EXAMPLE (a command line for its help), `add_arguments(parser)` and `run(arguments) -> exit code`. Only
the module of the requested verb is imported, and it imports its own dependencies inside `run(arguments)`, so that help
appears at once.
"""
