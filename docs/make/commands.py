"""docs/reference/commands.md: every verb with its arguments, from the parsers that `--help` prints."""

import argparse
from collections.abc import Iterator

from bridge import exit_codes
from docs.make.markdown import MADE, code, table
from tui import cli


def page() -> str:
    verbs = "".join(_verb(verb) for verb in cli.VERBS)
    codes = table(("code", "meaning"), ((str(code), words) for code, words in exit_codes.MEANINGS.items()))
    return (
        f"# Verbs and options\n\n{MADE} What they do and why: [the command](../commands.md).\n\n"
        f"{verbs}## Exit codes\n\n{codes}"
    )


def _verb(verb: str) -> str:
    parser = cli.verb_parser(verb)
    example = (parser.epilog or "").removeprefix("example:").strip()
    text = f"## {verb}\n\n{parser.description}\n\n    {example}\n\n"
    rows = [_row(action) for action in _arguments(parser)]
    text += table(("argument", "what it is"), rows) + "\n" if rows else ""
    for name, sub in _actions(parser):
        text += f"### {verb} {name}\n\n{sub.description or ''}\n\n".replace("\n\n\n", "\n")
        text += table(("argument", "what it is"), (_row(action) for action in _arguments(sub))) + "\n"
    return text


def _arguments(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    for action in parser._actions:
        if not isinstance(action, argparse._HelpAction | argparse._SubParsersAction):
            yield action


def _actions(parser: argparse.ArgumentParser) -> Iterator[tuple[str, argparse.ArgumentParser]]:
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            yield from action.choices.items()


def _row(action: argparse.Action) -> tuple[str, str]:
    typed = " ".join(filter(None, (", ".join(action.option_strings), _value(action))))
    words = (action.help or "").replace("%%", "%")
    if action.choices is not None and not all(str(choice) in words for choice in action.choices):
        words = f"{', '.join(map(str, action.choices))}; {words}"
    must = "; always needed" if action.required and action.option_strings else ""
    return code(typed), words + must


def _value(action: argparse.Action) -> str:
    """The value of an option, as `--help` shows it."""
    if action.nargs == 0:
        return ""
    if isinstance(action.metavar, tuple):
        return " ".join(action.metavar)
    name = action.metavar or action.dest.upper()
    if action.choices is not None and action.metavar is None:
        name = "WORD"
    if action.nargs == "?":
        return f"[{name}]"
    if action.nargs == "*":
        return f"[{name} ...]"
    if action.nargs == "+":
        return f"{name} [{name} ...]"
    return " ".join([name] * action.nargs) if isinstance(action.nargs, int) else name
