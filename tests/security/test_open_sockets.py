"""Open sockets: on this computer alone by default, and all of them listed at the start."""

import os
import socket
import threading
from argparse import ArgumentParser, Namespace
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest
from fakes.ports import free_port
from fakes.vehicle import QuietLink
from pymavlink.dialects.v20 import ardupilotmega as dialect

import bridge.onboard.ports  # noqa: F401  (before any test replaces what it imports)
from bridge.clock import SimulatedClock, SystemClock
from bridge.links.addresses import listening, of_link
from bridge.links.link import memory_pair
from bridge.links.open import open_link
from bridge.links.secured import Opener, on_words
from bridge.onboard.program import sockets
from bridge.vehicle.config import Device, load_vehicle
from bridge.wire.framing import Encoder
from gcs_plugin.recording.state import Holding, write_holding
from tui import cli
from tui.commands import tui as app
from tui.links import link_for


def own_sockets():
    """Protocol, address and port of every socket of IPv4 that this process has, by the system's own tables."""
    inodes = set()
    for entry in Path("/proc/self/fd").iterdir():
        try:
            target = os.readlink(entry)
        except FileNotFoundError:
            continue
        if target.startswith("socket:["):
            inodes.add(target[8:-1])
    result = set()
    for protocol in ("tcp", "udp"):
        for row in Path(f"/proc/self/net/{protocol}").read_text().splitlines()[1:]:
            words = row.split()
            if words[9] in inodes:
                address, port = words[1].split(":")
                host = socket.inet_ntoa(bytes.fromhex(address)[::-1])
                result.add((protocol.upper(), host, int(port, 16)))
    return result


@pytest.mark.parametrize("spec", ["udpin::0", "tcpin::0", "udpout::9", "udpout:localhost:9"])
def test_a_link_that_names_no_network_is_open_to_this_computer_alone(spec):
    before = own_sockets()
    with closing(open_link(spec)):
        opened = own_sockets() - before
    assert [host for _, host, _ in opened] == ["127.0.0.1"]


def test_a_recording_lists_every_socket_that_it_has(tmp_path, monkeypatch, capsys):
    before, opened = own_sockets(), set()

    def looked(work, *_):
        opened.update(own_sockets() - before)
        stop = threading.Event()
        stop.set()
        work(stop)

    monkeypatch.setattr("bridge.command_line.until_stopped", looked)
    port = free_port(socket.SOCK_DGRAM)
    cli.main(["record", "--link", f"udpin::{port}", "--out", str(tmp_path)])
    lines = [line for line in capsys.readouterr().err.splitlines() if line.startswith("open: ")]
    assert len(opened) == len(lines) == 2
    for protocol, host, number in opened:
        assert any(line.startswith(f"open: {host} port {number} ({protocol}): ") for line in lines)
    assert all(line.endswith("reachable from this computer alone") for line in lines)


VERBS = {
    "applet check": ["--vehicle", "bluerov2"],
    "bridge": ["--vehicle", "ruvifist:hovering"],
    "doctor": ["--seconds", "0.1"],
    "fetch": ["--new"],
    "fly": ["plan.yaml", "--limits", "limits.yaml", "--vehicle", "ruvifist:hovering", "--armed"],
    "ff off": [],
    "ff both": ["--yes"],
    "params diff": ["new.param"],
    "params rollback": [],
    "params show": [],
    "params upload": ["new.param", "--yes"],
    "record": ["--hub", "none"],
    "replay": ["dive.tlog"],
    "simulate": ["--vehicle", "ruvifist:hovering", "--mission", "idle"],
    "simulate a mission": ["--vehicle", "ruvifist:hovering", "--mission", "survey"],
    "watch": [],
    "watch --once": [],
}


def opens_a_link(parser):
    """Whether a verb, or one of its actions, has the option --link."""
    links = [action for action in parser._actions if "--link" in action.option_strings]
    choices = [
        choice for a in parser._actions if isinstance(a.choices, dict) for choice in a.choices.values()
    ]
    inner = [choice for choice in choices if isinstance(choice, ArgumentParser)]
    return bool(links) or any(map(opens_a_link, inner))


def test_no_verb_that_opens_a_link_is_left_out_here():
    results = {verb for verb in cli.VERBS if opens_a_link(cli.verb_parser(verb))}
    # calibrate opens its link by fly, params and ff.
    assert results == {line.split()[0] for line in VERBS} | {"tui", "calibrate"}


class Ended(QuietLink):
    """A link that ends whoever reads or writes it, as Ctrl-C does."""

    def __init__(self, link):
        self.name, self.close = link.name, link.close

    def read(self, _):
        raise KeyboardInterrupt

    def write(self, _):
        raise KeyboardInterrupt


@pytest.fixture
def at_once(tmp_path, monkeypatch):
    """Verbs that end as soon as they have opened what they open; the sockets that they had opened by then."""
    before, opened, links = own_sockets(), set(), []

    def ended(spec):
        link = open_link(spec)
        links.append(link)
        opened.update(own_sockets() - before)
        return Ended(link)

    def looked(work, *_):
        stop = threading.Event()
        stop.set()
        work(stop)

    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("bridge.links.open.open_link", ended)
    monkeypatch.setattr("bridge.command_line.until_stopped", looked)
    monkeypatch.setattr("tui.commands.simulate.dive", lambda *_: 0)
    frame = Encoder(1, 1).encode(dialect.MAVLink_heartbeat_message(12, 0, 0, 0, 4, 3))
    (tmp_path / "dive.tlog").write_bytes((1_790_000_000_000_000).to_bytes(8, "big") + frame)
    (tmp_path / "new.param").write_text("FF1_M_U,111.5\n", encoding="utf-8")
    (tmp_path / "plan.yaml").write_text(
        "start_depth_m: 1.5\nlegs: [{duration_s: 5, push_surge_n: 20}]\n", encoding="utf-8"
    )
    limits = "{shallowest_m: 0, deepest_m: 4, altitude_m: 0, distance_m: 4, speed_m_s: 1, tilt_deg: 20, "
    limits += "battery_v: 0, time_s: 9}"
    (tmp_path / "limits.yaml").write_text(limits, encoding="utf-8")
    yield opened
    for link in links:
        link.close()


def listed(said):
    return [line for line in said.splitlines() if line.startswith("open: ")]


@pytest.mark.parametrize("line", VERBS)
def test_every_verb_lists_the_socket_of_its_link_where_words_go(line, at_once, capsys):
    port = free_port(socket.SOCK_DGRAM)
    words = [word for word in line.split() if word not in ("a", "mission")]
    cli.main([*words, *VERBS[line], "--link", f"udpin::{port}"])
    said = capsys.readouterr()
    assert at_once == {("UDP", "127.0.0.1", port)}
    (sentence,) = listed(said.err)
    assert sentence.startswith(f"open: 127.0.0.1 port {port} (UDP): ")
    assert sentence.endswith("reachable from this computer alone")
    assert listed(said.out) == []


def test_a_link_that_comes_back_is_listed_once(capsys):
    opener = Opener(None, SimulatedClock(), on_words)
    for _ in range(3):
        opener.open("udpin::0").close()
    assert len(listed(capsys.readouterr().err)) == 1


def recording(clock, folder):
    return Holding(
        os.getpid(), "tcp:127.0.0.1:4711", ("udpin:0.0.0.0:14550",), folder, "2026-11-20T09:12:03Z", 1, 1, 0, 7200.0,
        (), clock.unix_s(),
    )  # fmt: skip


def test_by_way_of_a_recording_the_way_to_it_is_listed(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    write_holding(recording(SystemClock(), "dives/a"))
    monkeypatch.setattr("bridge.links.open.open_link", lambda _: memory_pair()[0])
    link_for(None)
    assert listed(capsys.readouterr().err) == [
        "open: a port of its own (TCP): what it serves, with 127.0.0.1 port 4711 and nobody else"
    ]


def test_the_app_lists_what_it_and_its_recording_have_open(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    app.list_sockets(Namespace(unrecorded=True, link=["udpin:0.0.0.0:14550"]))
    assert listed(capsys.readouterr().err) == [
        "open: 0.0.0.0 port 14550 (UDP): the link, reachable from every network of this computer"
    ]
    write_holding(recording(SystemClock(), "dives/a"))
    app.list_sockets(Namespace(unrecorded=False, link=[]))
    assert listed(capsys.readouterr().err) == [
        "open: 127.0.0.1 port 4711 (TCP): what is recorded, for params, doctor, ff and others, reachable from this "
        "computer alone",
        "open: 0.0.0.0 port 14550 (UDP): a link that is recorded, reachable from every network of this computer",
        "open: a port of its own (TCP): what it serves, with 127.0.0.1 port 4711 and nobody else",
    ]


@pytest.mark.parametrize(
    ("host", "whence"),
    [
        ("127.0.0.1", "this computer alone"),
        ("localhost", "this computer alone"),
        ("0.0.0.0", "every network of this computer"),
        ("192.168.2.1", "the network of 192.168.2.1"),
    ],
)
def test_a_listener_says_from_where_it_can_be_reached(host, whence):
    assert listening("TCP", host, 8000, "the page") == (
        f"open: {host} port 8000 (TCP): the page, reachable from {whence}"
    )


def test_a_link_that_sends_says_with_whom_and_a_serial_port_is_no_socket():
    assert of_link("udpout:192.168.2.2:14550", "a link") == [
        "open: a port of its own (UDP): a link, with 192.168.2.2 port 14550 and nobody else"
    ]
    assert of_link("serial:/dev/ttyUSB0:57600", "a link") == []


def test_a_bridge_lists_links_and_the_devices_that_it_speaks_tcp_with():
    vehicle = load_vehicle("ruvifist").vehicle
    dvl = Device("a50", port="tcp:192.168.2.95:16171")
    networked = replace(vehicle, sensors=replace(vehicle.sensors, dvl=dvl))
    assert sockets(["udpin:0.0.0.0:14550", "serial:/dev/ttyS0"], networked) == [
        "open: 0.0.0.0 port 14550 (UDP): a link to the ground, reachable from every network of this computer",
        "open: a port of its own (TCP): the dvl, with 192.168.2.95 port 16171 and nobody else",
    ]
