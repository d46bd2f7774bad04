"""What is open on networks: on this computer alone unless told, and all of it listed at the start."""

import os
import socket
import threading
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest

from bridge.clock import SimulatedClock
from bridge.link.open import open_link
from bridge.vehicle.config import Device, load_vehicle
from gcs_plugin.hub import Hub
from tui import cli
from tui.commands.bridge import sockets
from tui.sockets import listening, of_link, of_served


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
    found = set()
    for protocol in ("tcp", "udp"):
        for row in Path(f"/proc/self/net/{protocol}").read_text().splitlines()[1:]:
            words = row.split()
            if words[9] in inodes:
                address, port = words[1].split(":")
                host = socket.inet_ntoa(bytes.fromhex(address)[::-1])
                found.add((protocol.upper(), host, int(port, 16)))
    return found


@pytest.mark.parametrize("spec", ["udpin::0", "tcpin::0", "udpout::9", "udpout:localhost:9"])
def test_a_link_that_names_no_network_is_open_to_this_computer_alone(spec):
    before = own_sockets()
    with closing(open_link(spec)):
        opened = own_sockets() - before
    assert [host for _, host, _ in opened] == ["127.0.0.1"]


def test_the_hub_is_open_to_this_computer_alone():
    before = own_sockets()
    with closing(Hub(SimulatedClock())) as hub:
        opened = own_sockets() - before
        assert of_served(hub.address).startswith("open: 127.0.0.1 port ")
    assert [host for _, host, _ in opened] == ["127.0.0.1"]


def test_a_recording_lists_every_socket_that_it_has(tmp_path, monkeypatch, capsys):
    before, opened = own_sockets(), set()

    def looked(work, *_):
        opened.update(own_sockets() - before)
        stop = threading.Event()
        stop.set()
        work(stop)

    monkeypatch.setattr("tui.running.until_stopped", looked)
    with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    cli.main(["record", "--link", f"udpin::{port}", "--out", str(tmp_path)])
    lines = [line for line in capsys.readouterr().err.splitlines() if line.startswith("open: ")]
    assert len(opened) == len(lines) == 2
    for protocol, host, number in opened:
        assert any(line.startswith(f"open: {host} port {number} ({protocol}): ") for line in lines)
    assert all(line.endswith("reachable from this computer alone") for line in lines)


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
