"""The frame of the `seatrial` command: verbs, help, exit codes, one sentence an error."""

import os
import re
import subprocess
import sys
from argparse import ArgumentParser
from pathlib import Path

import pytest

from bridge import exit_codes
from bridge.errors import ConfigError, FitError, LinkLost, LogError, ParamUnverified
from bridge.onboard import program
from tui import cli
from tui.files import settings

ROOT = Path(__file__).resolve().parents[2]
COMMANDS = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")


def section(verb):
    result = re.search(rf"^## {verb}\n(.*?)(?=^## |\Z)", COMMANDS, re.M | re.S)
    return result.group(1) if result else ""


@pytest.mark.parametrize("verb", cli.VERBS)
def test_every_verb_has_help_with_an_example_that_it_takes(verb, capsys):
    assert cli.main([verb, "--help"]) == exit_codes.DONE
    shown = capsys.readouterr().out
    example = cli.VERBS[verb].example
    assert example in shown
    words = example.split()
    assert words[:2] == ["seatrial", verb]
    cli.verb_parser(verb).parse_args(words[2:])


def test_a_page_has_among_its_settings_no_word_that_nobody_gave():
    line = cli.verb_parser("validate").parse_args(["dives/pid", "--vehicle", "ruvifist"])
    line.began_unix_s = 1796038321.9760191
    assert set(settings(line)) == {"dives", "vehicle", "receipts"}


def actions(verb):
    choices = [
        action.choices for action in cli.verb_parser(verb)._actions if isinstance(action.choices, dict)
    ]
    return [name for named in choices for name, inner in named.items() if isinstance(inner, ArgumentParser)]


@pytest.mark.parametrize(
    ("verb", "action"), [(verb, action) for verb in cli.VERBS for action in actions(verb)], ids=str
)
def test_every_action_of_a_verb_has_help_with_an_example_of_it(verb, action, capsys):
    assert cli.main([verb, action, "--help"]) == exit_codes.DONE
    assert f"example:\n  seatrial {verb} {action} " in capsys.readouterr().out


@pytest.mark.parametrize("verb", cli.VERBS)
def test_every_verb_is_explained(verb):
    assert section(verb), f"docs/commands.md has no section '## {verb}'"


def test_every_exit_code_is_documented():
    assert all(f"| {code} | {meaning} |" in COMMANDS for code, meaning in exit_codes.MEANINGS.items())


def test_top_help_names_every_verb(capsys):
    assert cli.main(["--help"]) == exit_codes.DONE
    shown = capsys.readouterr().out
    assert all(f"  {verb} " in shown for verb in cli.VERBS)


def test_no_verb_shows_help_and_is_wrong_usage(capsys):
    assert cli.main([]) == exit_codes.BAD_INPUT
    assert "verbs:" in capsys.readouterr().err


def test_a_misspelt_verb_names_the_nearest(capsys):
    assert cli.main(["identfy"]) == exit_codes.BAD_INPUT
    assert capsys.readouterr().err == "seatrial: unknown verb 'identfy'; did you mean 'identify'?\n"


def test_a_missing_argument_is_one_sentence_that_names_the_help(capsys):
    assert cli.main(["identify", "x.tlog"]) == exit_codes.BAD_INPUT
    error = capsys.readouterr().err
    assert error.startswith("seatrial: ")
    assert error.count("\n") == 1
    assert "--vehicle" in error
    assert "seatrial identify --help" in error


class Failing:
    """A verb's module that ends in whatever it is given."""

    def __init__(self, error):
        self.error = error

    def run(self, _):
        raise self.error


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (ConfigError("a"), exit_codes.BAD_INPUT),
        (LogError("b"), exit_codes.BAD_INPUT),
        (LinkLost("c"), exit_codes.LINK),
        (FitError("d"), exit_codes.NO),
        (ParamUnverified("e"), exit_codes.NO),
        (PermissionError(13, "Permission denied", "/f"), exit_codes.BAD_INPUT),
        (KeyboardInterrupt(), exit_codes.INTERRUPTED),
    ],
)
def test_each_error_has_its_exit_code_and_one_line(error, code, monkeypatch, capsys):
    monkeypatch.setattr(cli, "module_of", lambda _: Failing(error))
    assert cli.main(["demo"]) == code
    shown = capsys.readouterr().err
    assert shown.startswith("seatrial: ")
    assert shown.count("\n") == 1


def chained(depth):
    """Ctrl-C in compiled code: a SystemError with it so many errors below."""
    error = KeyboardInterrupt()
    for _ in range(depth):
        outer = SystemError("<function> returned a result with an exception set")
        outer.__cause__, error = error, outer
    return error


@pytest.mark.parametrize("depth", [1, 2])
def test_control_c_within_compiled_code_is_one_sentence(depth, monkeypatch, capsys):
    monkeypatch.setattr(cli, "module_of", lambda _: Failing(chained(depth)))
    assert cli.main(["demo"]) == exit_codes.INTERRUPTED
    assert capsys.readouterr().err == "seatrial: stopped before it was done\n"


def test_control_c_met_while_another_error_was_handled_is_one_sentence(monkeypatch):
    error = SystemError("<function> returned a result with an exception set")
    error.__context__ = KeyboardInterrupt()
    monkeypatch.setattr(cli, "module_of", lambda _: Failing(error))
    assert cli.main(["demo"]) == exit_codes.INTERRUPTED


def test_a_system_error_of_its_own_is_not_taken_for_control_c(monkeypatch):
    monkeypatch.setattr(cli, "module_of", lambda _: Failing(SystemError("bad internal call")))
    with pytest.raises(SystemError, match="bad internal call"):
        cli.main(["demo"])


def test_control_c_after_all_is_done_changes_nothing_any_more():
    program = (
        "import os, signal, sys; from tui import cli; cli.main = lambda **_: 5; code = cli.command(); "
        "os.kill(os.getpid(), signal.SIGINT); sys.exit(code)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT, check=False
    )
    assert (done.returncode, done.stderr) == (5, "")


def test_control_c_while_the_vehicles_program_loads_is_one_sentence(monkeypatch, capsys):
    def interrupted(_):
        raise KeyboardInterrupt

    monkeypatch.setattr(program, "run", interrupted)
    line = ["--vehicle", "ruvifist:hovering", "--link", "udpout:127.0.0.1:9"]
    assert program.main(line) == exit_codes.INTERRUPTED
    assert capsys.readouterr().err == "seatrial-bridge: stopped before it was done\n"


SHOWS = """
import sys
from tui import cli
from tui.show import Table, put, results

def shown(**_):
    put(results(), Table("", ("speed",), [("\u2248 3 \u00b1 1",)]))
    return 0

cli.main = shown
sys.exit(cli.command())
"""


def test_a_terminal_whose_locale_lacks_a_character_shows_a_mark_in_its_place():
    done = subprocess.run(
        [sys.executable, "-c", SHOWS],
        capture_output=True,
        cwd=ROOT,
        check=False,
        env=os.environ | {"PYTHONIOENCODING": "latin-1"},
    )
    assert (done.returncode, done.stderr) == (0, b"")
    assert "? 3 \u00b1 1" in done.stdout.decode("latin-1")


RUNS = """
import os, signal
from bridge.clock import SystemClock
from bridge.command_line import until_stopped

looks = 0

def work(stop):
    stop.wait(30.0)
    print("ended in order")

def each(_):
    global looks
    looks += 1
    os.kill(os.getpid(), signal.{signal})
    return looks == 3

{before}
until_stopped(work, SystemClock(), None, each)
print(looks)
"""


@pytest.mark.parametrize(
    ("signal", "before", "looks"),
    [
        ("SIGINT", "", 1),
        ("SIGTERM", "", 1),
        ("SIGHUP", "", 1),
        ("SIGHUP", "signal.signal(signal.SIGHUP, signal.SIG_IGN)", 3),
    ],
    ids=["Ctrl-C", "SIGTERM", "closed terminal", "nohup"],
)
def test_a_run_ends_in_order_also_where_its_terminal_is_closed_and_goes_on_under_nohup(signal, before, looks):
    program = RUNS.format(signal=signal, before=before)
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT, check=False
    )
    assert (done.returncode, done.stdout) == (0, f"ended in order\n{looks}\n")


def test_the_installed_command_runs():
    done = subprocess.run(
        [Path(sys.executable).with_name("seatrial"), "--version"], capture_output=True, text=True, check=True
    )
    assert re.fullmatch(r"seatrial \d+\.\d+\.\d+\n", done.stdout)
