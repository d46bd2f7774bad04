"""Nothing that a vehicle, a file or a name says can steer a terminal, hide in a line, or end a verb."""

import io
from types import SimpleNamespace
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect
from textual.app import App

from bridge.text import printable
from bridge.vehicle.config import CONFIGS, load_vehicle
from bridge.wire.framing import Encoder
from bridge.wire.tlog import TlogWriter
from gcs_plugin.dives.folder import About, DiveFolder, Event
from gcs_plugin.params.files import read_parameters, write_parameters
from tui import show
from tui.app.app import SeatrialApp
from tui.cli import main

STEERING = "\x1b]0;mine\x1b\\\x1b[2J\x9b31m\x85\u202egnp\u200b\udcff"
SHOWN = "?]0;mine?\\?[2J?31m??gnp??"


def steers(text):
    return printable(text, keep="\n\t") != text


def console(terminal):
    made = show.results()
    made.file = out = io.StringIO()
    made._force_terminal, made.is_interactive, made.no_color = terminal, terminal, True
    return made, out


def test_text_keeps_all_that_is_harmless():
    for text in ("plain", "µ ± 95 % °C", "a\u00a0b\u2009c", "Tauchgang Überlingen", "潜水"):
        assert printable(text) == text
    assert printable(STEERING) == "]0;mine\\[2J31mgnp"
    assert printable("a\nb\tc", keep="\n\t") == "a\nb\tc"


@pytest.mark.parametrize("terminal", [False, True])
def test_tables_sentences_and_progress_mark_what_could_steer(terminal):
    shown, out = console(terminal)
    show.put(shown, show.Table(STEERING, (STEERING, "value"), [(STEERING, STEERING), ("[/x]", "1")]))
    show.say(shown, f"notes: {STEERING} and [bold]so[/]")
    assert not steers(out.getvalue())
    assert out.getvalue().count(SHOWN) == 5
    assert "and [bold]so[/]" in out.getvalue()
    lines = out.getvalue().splitlines()
    assert lines[3].index(SHOWN) == 0
    assert lines[3][len(SHOWN) :] == f"  {SHOWN}"


def test_progress_on_a_terminal_takes_any_name(monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    shown, out = console(True)
    monkeypatch.setattr(show, "words", lambda: shown)
    with show.progress("reading") as tell:
        tell(0.5, f"[/x] {STEERING}")
    assert "[/x] ?]0;mine?\\?[2J" in out.getvalue()


def hostile_dive(root):
    folder = DiveFolder(root / f"2026-11-20T0912Z-{STEERING.replace('/', '')}")
    folder.path.mkdir()
    encoder = Encoder(1, 1)
    with TlogWriter(folder.path / "telemetry.tlog") as writer:
        for n in range(40):
            said = (
                dialect.MAVLink_statustext_message(2, b"\x1b[2J\x9b31mhello"),
                dialect.MAVLink_param_value_message(b"\x1b[2J\x1b[31mA", 1.0, 9, 1, 0),
                dialect.MAVLink_named_value_float_message(n, b"\x1b[2J", 1.0),
                dialect.MAVLink_attitude_message(n * 25, 0, 0, 0, 0, 0, 0.1),
            )
            for message in said:
                writer.write(1_790_000_000_000_000 + n * 25_000, encoder.encode(message))
    folder.describe(About(STEERING[:-1], "", STEERING[:-1], STEERING[:-1], (Event("2026", STEERING[:-1]),)))
    return folder


def test_verbs_that_read_a_hostile_dive_print_nothing_that_steers(tmp_path, capfd, monkeypatch):
    dive = hostile_dive(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    for line in (
        ("dives", str(tmp_path)),
        ("import", str(dive.path)),
        ("identify", str(dive.path), "--vehicle", STEERING),
        ("params", "diff", STEERING, "--link", "udp:1"),
        (STEERING,),
    ):
        main(line)
        said = "".join(capfd.readouterr())
        assert said
        assert not steers(said), line


def test_what_a_dive_says_of_itself_is_harmless_once_it_is_read(tmp_path):
    about = hostile_dive(tmp_path).about()
    assert {about.vehicle_file, about.configuration, about.notes, about.events[0].text} == {
        "]0;mine\\[2J31mgnp"
    }


def test_the_name_of_a_vehicle_is_harmless_once_it_is_read(tmp_path):
    text = (CONFIGS / "vehicles" / "ruvifist.yaml").read_text(encoding="utf-8")
    named = [r'name: "\e[2J\x9bmine"' if line.startswith("name:") else line for line in text.splitlines()]
    path = tmp_path / "hostile.yaml"
    path.write_text("\n".join(named), encoding="utf-8")
    assert load_vehicle(str(path)).vehicle.name == "[2Jmine"


def test_a_parameter_file_leaves_out_names_that_are_none_and_says_so(tmp_path):
    path = tmp_path / "before.param"
    write_parameters(path, {"A": 1.0, "\x1b[2J": 2.0, "X\nFF_MODE": 3.0}, [f"of {STEERING[:-1]}"])
    assert read_parameters(path) == {"A": 1.0}
    assert not steers(path.read_text(encoding="utf-8"))
    assert "# left out, since no parameter has such a name: ?[2J, X?FF_MODE" in path.read_text(
        encoding="utf-8"
    )


def test_the_app_tells_a_name_as_it_stands(monkeypatch):
    notices: list[tuple[str, Any]] = []
    monkeypatch.setattr(App, "notify", lambda _, message, **how: notices.append((message, how["markup"])))
    SeatrialApp.notify(object.__new__(SeatrialApp), f"[/x] {STEERING}")
    assert notices == [(f"[/x] {SHOWN}", False)]


def test_a_line_of_mavproxy_is_harmless():
    module = pytest.importorskip("gcs_plugin.mavproxy.module")
    lines: list[str] = []
    stand_in = SimpleNamespace(console=SimpleNamespace(writeln=lines.append))
    module.SeatrialModule.say_line(stand_in, f"name {STEERING}")
    assert lines == [f"name {SHOWN}"]
