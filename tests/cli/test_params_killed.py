"""`seatrial params upload` killed at each message that it sends: the next command tells what is so and mends it."""

import re
from pathlib import Path

import pytest
from figures import keep
from parameter_vehicle import GroundKilledError, at_any_link, dying_at

from bridge.parameters import set_crc
from tui import cli, exit_codes

OLD = {"FF1_M_U": 99.0, "FF1_D_U": 40.0}
NEW = {"FF1_M_U": 111.5, "FF1_D_U": 56.25}
MOST = 1000
TOLD = re.compile(r"never finished: of its 2 values (\d) are on the vehicle(, and its set \d+ flies)?")


@pytest.fixture
def sea(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "new.param").write_text("FF1_M_U,111.5\nFF1_D_U,56.25\n", encoding="utf-8")

    def begin():
        store = Path.cwd() / "store.json"
        store.unlink(missing_ok=True)
        vehicle = at_any_link(monkeypatch, store)
        for name, value in OLD.items():
            vehicle.server.write(name, value, armed=False)
        vehicle.server.write("FF_COMMIT", float(vehicle.server.staged_crc), armed=False)
        return vehicle

    return begin


def run(vehicle, *line):
    vehicle.clock.advance_to(vehicle.clock.now_s + 2.0)
    return cli.main(["params", *line, "--link", "any"])


def upload(vehicle, message):
    """Upload until the ground dies at a message; whether it did."""
    with dying_at(vehicle, message) as sent:
        try:
            assert run(vehicle, "upload", "new.param", "--yes") == exit_codes.DONE
        except GroundKilledError:
            return True, len(sent)
    return False, len(sent)


def flies(vehicle):
    return {name: vehicle.server.active(1)[name[4] + "_u"] for name in OLD}


def told_is_so(vehicle, said):
    """Where there is a receipt that says BEGUN, it is told what of it is on the vehicle and what flies."""
    staged = {name: vehicle.server.value(name) for name in NEW}
    assert vehicle.server.active_crc in (set_of(vehicle, OLD), set_of(vehicle, NEW))
    found = TOLD.search(" ".join(said.split()))
    if found is None:
        assert (staged, flies(vehicle)) == (OLD, OLD)
        return False
    assert int(found[1]) == sum(staged[name] == NEW[name] for name in NEW)
    assert bool(found[2]) == (flies(vehicle) == NEW)
    return True


def set_of(vehicle, values):
    table = {name: vehicle.server.value(name) for name in vehicle.server.names[:-4]}
    return set_crc(table | values)


def mended_from(sea, message, capsys, finishes):
    vehicle = sea()
    died, _ = upload(vehicle, message)
    assert died
    if message % 3 == 0:
        vehicle.boot()
    capsys.readouterr()
    run(vehicle, "show", "FF1_M_U")
    begun = told_is_so(vehicle, capsys.readouterr().err)
    if finishes or not begun:
        assert run(vehicle, "upload", "new.param", "--yes") == exit_codes.DONE
        assert flies(vehicle) == NEW
    if not finishes or not begun:
        assert run(vehicle, "rollback", "--yes") == exit_codes.DONE
        assert flies(vehicle) == OLD
    run(vehicle, "show", "FF1_M_U")
    assert "never finished" not in capsys.readouterr().err


def messages(sea):
    return upload(sea(), MOST)[1]


def in_a_new_folder(tmp_path, monkeypatch, name):
    folder = tmp_path / str(name)
    folder.mkdir()
    (folder / "new.param").write_bytes((tmp_path / "new.param").read_bytes())
    monkeypatch.chdir(folder)


def test_a_ground_killed_at_any_of_its_writes_or_just_before_tells_so_and_mends_it(
    sea, tmp_path, monkeypatch, capsys
):
    with dying_at(vehicle := sea(), MOST) as sent:
        assert run(vehicle, "upload", "new.param", "--yes") == exit_codes.DONE
    writes = [place for place, kind in enumerate(sent, start=1) if kind == "PARAM_SET"]
    assert len(writes) == 3
    for message in sorted({*writes, writes[-1] + 1, len(sent)}):
        in_a_new_folder(tmp_path, monkeypatch, message)
        mended_from(sea, message, capsys, finishes=message % 2 == 0)


@pytest.mark.soak
def test_a_ground_killed_at_any_message_tells_so_and_mends_it(sea, tmp_path, monkeypatch, capsys):
    count = messages(sea)
    for message in range(1, count + 1):
        for finishes in (True, False):
            in_a_new_folder(tmp_path, monkeypatch, f"{message}-{finishes}")
            mended_from(sea, message, capsys, finishes)
    keep(
        "upload_cut",
        f"killed at each of {count} messages: {count} finished, {count} rolled back, none told wrongly",
    )
