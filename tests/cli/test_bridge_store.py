"""`seatrial bridge` stores the mode without holding up its loop."""

import os
import socket
import threading

from fakes.ports import free_port
from fakes.processes import Running
from pymavlink.dialects.v20 import ardupilotmega as dialect
from test_bridge_ring import VEHICLE

from bridge import exit_codes
from bridge.onboard.store import load
from bridge.wire.framing import Encoder
from tui import cli


def test_the_loop_waits_for_no_disk_where_the_mode_is_set(tmp_path, monkeypatch):
    port, over, fsync, threads = free_port(socket.SOCK_DGRAM), threading.Event(), os.fsync, set()
    order = Encoder(255, 190).encode(dialect.MAVLink_param_set_message(1, 1, b"FF_MODE", 1.0, 9))

    def orders():
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as end:
            while not over.wait(0.1):
                end.sendto(order, ("127.0.0.1", port))

    def synced(file):
        threads.add(threading.current_thread().name)
        fsync(file)

    monkeypatch.setattr("os.fsync", synced)
    ground = threading.Thread(target=orders)
    ground.start()
    try:
        store = tmp_path / "parameters.json"
        ways = ("--link", f"udpin:127.0.0.1:{port}", "--parameters", str(store), "--seconds", "2")
        assert cli.main(["bridge", "--vehicle", VEHICLE, *ways]) in (exit_codes.DONE, exit_codes.LINK)
    finally:
        over.set()
        ground.join()
    assert [stored.mode for stored in load(store).values()] == [1.0]
    assert threads == {"store_0"}


def test_a_second_bridge_that_would_overwrite_the_parameters_of_the_first_does_not_start(tmp_path, capsys):
    ways = (
        "bridge",
        "--vehicle",
        VEHICLE,
        "--link",
        "udpout:127.0.0.1:9",
        "--parameters",
        str(tmp_path / "p.json"),
    )
    first = Running(*ways)
    try:
        first.until("Ctrl-C ends it")
        assert cli.main([*ways, "--seconds", "1"]) == exit_codes.BAD_INPUT
        said = " ".join(capsys.readouterr().err.split())
        assert (
            f"another bridge (process {first.process.pid}) keeps its parameters there: end that one" in said
        )
    finally:
        first.kill()
    assert cli.main([*ways, "--seconds", "1"]) in (exit_codes.DONE, exit_codes.LINK), (
        "a killed one locks nobody out"
    )
