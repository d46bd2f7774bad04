"""`seatrial bridge`: the vehicle's own recording, and the mode that it stores."""

import os
import socket
import threading
from pathlib import Path

from fakes.ports import free_port
from fakes.processes import Running
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge import exit_codes
from bridge.onboard import program
from bridge.onboard.store import load
from bridge.wire.framing import Encoder
from bridge.wire.tlog import MOST_BYTES
from tui import cli

VEHICLE = str(Path(__file__).resolve().parents[1] / "data" / "vehicles" / "hovering.yaml")


def bridge(folder, *more):
    link = ["--link", "udpout:127.0.0.1:9", "--parameters", str(folder.parent / "parameters.json")]
    return cli.main(["bridge", "--vehicle", VEHICLE, *link, "--ring", str(folder), *more])


def test_a_ring_of_too_few_files_is_refused_before_anything_begins(tmp_path, capsys):
    assert bridge(tmp_path / "ring", "--ring-mb", "3") == exit_codes.BAD_INPUT
    assert "holds fewer than 4 files of --segment-mb 4" in capsys.readouterr().err
    assert not (tmp_path / "ring").exists()


def test_files_that_the_ground_would_fetch_and_not_read_are_refused(tmp_path, capsys):
    assert bridge(tmp_path / "ring", "--ring-mb", "20000", "--segment-mb", "2001") == exit_codes.BAD_INPUT
    assert "no more than 2000 MB of a file are read" in " ".join(capsys.readouterr().err.split())
    assert program.MOST_SEGMENT_MB * program.MEGABYTE < MOST_BYTES


def test_a_ring_that_would_lie_in_a_file_is_refused(tmp_path, capsys):
    (tmp_path / "ring").write_text("")
    assert bridge(tmp_path / "ring") == exit_codes.BAD_INPUT
    assert "is no folder" in capsys.readouterr().err


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


def test_a_link_that_opens_and_carries_nothing_is_warned_of_once_and_not_called_back(tmp_path, capsys):
    """As on a vehicle that starts before its network; here the system refuses to send to all at once."""
    ways = ("--link", "udpout:255.255.255.255:9", "--parameters", str(tmp_path / "p.json"), "--seconds", "4")
    cli.main(["bridge", "--vehicle", VEHICLE, *ways])
    said = capsys.readouterr()
    warnings = [line for line in said.err.splitlines() if "udpout:255.255.255.255:9: " in line]
    assert warnings
    assert len(set(warnings)) == len(warnings)
    assert "is back" not in said.out + said.err
