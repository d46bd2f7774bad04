"""The verbs of the command seatrial, a module for each, with `run(arguments) -> exit code`.

Only the module of the requested verb is imported, and only to run it: its options are in `tui.verbs`.
"""
