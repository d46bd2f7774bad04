"""`params` stops at values that are out of bounds or implausible, and takes the latter by name alone."""

from dataclasses import replace
from pathlib import Path

import params_line
import pytest
from fakes.vehicle import VEHICLE
from params_line import DESPITE_HALF, run

from bridge import exit_codes
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.forecast import Credit
from gcs_plugin.params.files import write_parameters
from gcs_plugin.params.sidecar import Interval, Sidecar, write_sidecar

vehicle = params_line.vehicle
file = params_line.file


MASS_OF_THIS = "99999 is outside 21.6 to 2160, which is all that a vehicle of this mass and thrust can have"
WITH_FILE = ("--vehicle", VEHICLE)


@pytest.mark.parametrize(
    ("name", "value", "options", "why"),
    [
        ("FF1_M_U", "99999", WITH_FILE, f"FF1_M_U: {MASS_OF_THIS}"),
        ("FF1_D_U", "99999", WITH_FILE, "FF1_D_U: 99999 is outside 0.0072 to "),
        ("FF1_D_W", "0.007", WITH_FILE, "FF1_D_W: 0.007 is outside 0.0072 to "),
        ("FF1_X_UU", "99999", WITH_FILE, "FF1_X_UU: 99999 is outside 0 to "),
        ("FF1_M_U", "1e6", (), "FF1_M_U: 1e+06 is outside 0.1 to 100000 kg"),
        ("FF1_M_U", "0.05", (), "FF1_M_U: 0.05 is outside 0.1 to"),
        ("FF1_D_U", "-3", (), "FF1_D_U: -3 is outside 1e-05 to 100000 N/(m/s)"),
        ("FF1_D_U", "1e-40", (), "FF1_D_U: 9.99995e-41 is outside 1e-05 to 100000 N/(m/s)"),
        (
            "FF1_D_U",
            "0.011",
            (),
            "FF1_D_U: 0.011 is next to no damping beside FF1_M_U 111.5: half of a model",
        ),
        ("FF1_D_U", "1e-50", (), "line 2: FF1_D_U: 1e-50 is too small for a float32, which would hold 0"),
        ("FF1_D_U", "0.1e-400", (), "line 2: FF1_D_U is 0.1e-400, too small for any number"),
    ],
)
def test_a_value_that_no_vehicle_takes_or_not_this_one_is_refused_before_anything_is_sent(
    vehicle, tmp_path, capsys, name, value, options, why
):
    path = tmp_path / "wild.param"
    values = {"FF1_M_U": "111.5", "FF1_D_U": "56.25", name: value}
    path.write_text("".join(f"{name},{value}\n" for name, value in values.items()), encoding="utf-8")
    assert run("upload", str(path), *options, "--yes") != exit_codes.DONE
    assert why in " ".join(capsys.readouterr().err.split())
    assert [vehicle.server.value(name) for name in values] == [0.0] * len(values)
    assert not (tmp_path / "receipts").exists()


def test_an_implausible_value_that_another_ground_staged_comes_into_force_by_name_alone(
    vehicle, file, capsys
):
    assert run("upload", file, "--yes") == exit_codes.DONE
    flying = vehicle.server.active_crc
    write_parameters(Path(file), {"FF1_M_U": 111.5, "FF1_D_U": 5.0})
    vehicle.server.write("FF1_D_U", 5.0, armed=False)
    assert run("upload", file, "--yes") == exit_codes.NO
    assert "FF1_D_U: 56.25 was accepted last" in " ".join(capsys.readouterr().err.split())
    assert vehicle.server.active_crc == flying
    assert run("upload", file, "--yes", "--accept-implausible", "FF1_D_U") == exit_codes.DONE
    assert vehicle.server.active(1)["D_u"] == 5.0


def test_an_implausible_value_stops_all_and_is_taken_by_name_alone(vehicle, file, capsys):
    wide = Interval("M_u", "kg", 111.5 - 300.0, 111.5 + 300.0)
    write_sidecar(
        Path(file), Sidecar("d", "v", "hovering", "likelihood", "1", {"FF1_M_U": wide}, "ruvifist", "lake")
    )
    assert run("diff", file) == exit_codes.NO
    assert "1 changed, 1 implausible" in capsys.readouterr().out
    assert run("upload", file, "--yes") == exit_codes.NO
    said = " ".join(capsys.readouterr().err.split())
    assert "FF1_M_U: its standard deviation, 153.1, is as large as the value" in said
    assert "--accept-implausible FF1_M_U" in said
    assert run("upload", file, "--yes", "--accept-implausible", "FF1_D_U") == exit_codes.NO
    assert vehicle.server.active(1) == {}
    assert run("upload", file, "--yes", "--only", "FF1_D_U", *DESPITE_HALF) == exit_codes.DONE
    assert run("upload", file, "--yes", "--accept-implausible", "FF1_M_U") == exit_codes.DONE
    assert vehicle.server.active(1)["M_u"] == 111.5


@pytest.mark.parametrize(("half", "other"), [("FF1_M_U", "FF1_D_U"), ("FF1_D_U", "FF1_M_U")])
def test_half_a_model_of_an_axis_stops_all_before_anything_is_written_and_is_taken_by_name_alone(
    vehicle, file, capsys, half, other
):
    why = f"without {other} the feed-forward of surge stays off"
    assert run("diff", file, "--only", half) == exit_codes.NO
    assert f"implausible: {why}" in " ".join(capsys.readouterr().out.split())
    assert run("upload", file, "--yes", "--only", half) == exit_codes.NO
    said = " ".join(capsys.readouterr().err.split())
    assert f"{half}: {why}; nothing was sent" in said
    assert f"--accept-implausible {half}" in said
    assert vehicle.server.value(half) == 0.0
    assert run("upload", file, "--yes", "--only", half, "--accept-implausible", half) == exit_codes.DONE
    assert vehicle.server.active(1) == {half[4] + "_u": vehicle.server.value(half)}
    assert run("upload", file, "--yes", "--only", other) == exit_codes.DONE, "the vehicle holds the first"
    assert vehicle.server.active(1) == {"M_u": 111.5, "D_u": 56.25}


def test_a_file_raises_the_feed_forward_by_name_alone_and_may_lower_it(vehicle, file, capsys):
    raising = Path(file)
    raising.write_text("FF1_M_U,111.5\nFF1_D_U,56.25\nFF_MODE,3\n", encoding="utf-8")
    why = "FF_MODE: raises the feed-forward from off to both, which no file does by the way: seatrial ff both"
    assert run("upload", file, "--yes") == exit_codes.NO
    assert why in " ".join(capsys.readouterr().err.split())
    assert (vehicle.server.mode, vehicle.server.active(1)) == (0, {})
    assert run("upload", file, "--yes", "--accept-implausible", "FF_MODE") == exit_codes.DONE
    assert (vehicle.server.mode, vehicle.server.active(1)) == (3, {"M_u": 111.5, "D_u": 56.25})
    raising.write_text("FF_MODE,1\n", encoding="utf-8")
    assert run("upload", file, "--yes") == exit_codes.DONE
    assert run("rollback", "--yes") == exit_codes.DONE
    assert vehicle.server.mode == 1, "a roll back never raises it"


def test_a_change_that_what_was_accepted_last_speaks_against_stops_all_but_a_roll_back(
    vehicle, file, tmp_path, capsys
):
    assert run("upload", file, "--yes") == exit_codes.DONE
    typed = tmp_path / "typed.param"
    typed.write_text("FF1_D_U,562.5\n", encoding="utf-8")
    assert run("upload", str(typed), "--yes") == exit_codes.NO
    assert "56.25 was accepted last: this is 10 times as much" in " ".join(capsys.readouterr().err.split())
    assert run("upload", str(typed), "--yes", "--accept-implausible", "FF1_D_U") == exit_codes.DONE
    assert run("rollback", "--yes") == exit_codes.DONE
    assert vehicle.server.active(1)["D_u"] == 56.25


@pytest.mark.usefixtures("vehicle")
def test_with_a_vehicle_file_a_total_mass_below_its_dry_mass_stops_all(tmp_path, capsys):
    light = tmp_path / "light.param"
    dry_kg = load_vehicle(VEHICLE).vehicle.configurations["hovering"].dry_mass_kg
    light.write_text(f"FF1_M_U,{dry_kg / 2}\nFF1_D_U,56.25\n", encoding="utf-8")
    assert run("diff", str(light)) == exit_codes.NO
    assert "2 changed" in capsys.readouterr().out
    assert run("upload", str(light), "--vehicle", VEHICLE, "--yes") == exit_codes.NO
    assert "below the rigid body's own" in " ".join(capsys.readouterr().err.split())


def weak(path, credit):
    """A file with an accepted gain of the first thruster, and how the vehicle's own allocation went by it."""
    write_parameters(path, {"FF1_M_U": 111.5, "FF1_D_U": 56.25, "FF1_T1_GAIN": 0.8})
    about = Sidecar("d", "v", "hovering", "diagnose", "1", {}, "hovering", "lake", credits=(credit,))
    write_sidecar(path, about)
    return str(path)


BY_ITSELF = Credit(1, 1.0, 0.8, 0.8, acting=False)


@pytest.mark.parametrize(
    ("credit", "held", "given", "why"),
    [
        (
            BY_ITSELF,
            0.0,
            1.0,
            "thruster 1 is made up for already: the vehicle's own allocation went by 80 % of its curve where the "
            "diagnosis went by 100 %; with this it would be asked as if it gave 64 %, and it gives 80 %",
        ),
        (
            Credit(1, 1.0, 0.8, 1.0, acting=False),
            0.0,
            0.8,
            "the vehicle's file gives it 80 % of its curve where",
        ),
        (Credit(1, 1.0, 0.8, 0.8, acting=True), 0.0, 1.0, "the vehicle's own allocation went by 80 %"),
        (Credit(1, 0.8, 0.8, 0.8, acting=False), 0.0, 0.8, ""),
        (Credit(1, 1.0, 0.8, None, acting=False), 0.0, 1.0, ""),
        (Credit(1, 1.0, 0.8, 0.79, acting=True), 0.79, 1.0, ""),
        (Credit(1, 1.0, 0.8, 1.0, acting=True), 0.79, 1.0, ""),
        (Credit(2, 1.0, 0.8, 0.8, acting=False), 0.0, 1.0, ""),
    ],
    ids=[
        "by itself",
        "by its file",
        "when it flew",
        "on top of its own",
        "not recorded",
        "as held",
        "held only since",
        "another",
    ],
)
def test_a_gain_that_would_act_beside_the_vehicle_s_own_is_refused_and_taken_by_name_alone(
    vehicle, tmp_path, capsys, credit, held, given, why
):
    if held:
        for name, value in (("FF1_M_U", 111.0), ("FF1_D_U", 56.0), ("FF1_T1_GAIN", held)):
            vehicle.server.write(name, value, armed=False)
    shipped = load_vehicle(VEHICLE)
    vehicle_file = tmp_path / "own.yaml"
    text = shipped.path.read_text(encoding="utf-8")
    vehicle_file.write_text(
        text.replace("[0.42, -0.32, 0.0]}", f"[0.42, -0.32, 0.0], gain: {given}}}"), encoding="utf-8"
    )
    path = weak(tmp_path / "weak.param", credit)
    line = ("upload", path, "--yes", "--vehicle", str(vehicle_file))
    if why:
        assert run(*line) == exit_codes.NO
        said = " ".join(capsys.readouterr().err.split())
        assert why in said
        assert "--accept-implausible FF1_T1_GAIN" in said
        assert vehicle.server.value("FF1_T1_GAIN") == held
        line = (*line, "--accept-implausible", "FF1_T1_GAIN")
    assert run(*line) == exit_codes.DONE
    assert vehicle.server.active(1)["T1_gain"] == pytest.approx(0.8)


@pytest.mark.parametrize("by_itself", [True, False])
def test_a_gain_that_the_vehicle_holds_and_makes_up_for_by_itself_too_is_named_with_the_way_out(
    vehicle, tmp_path, capsys, by_itself
):
    credit = BY_ITSELF if by_itself else replace(BY_ITSELF, allocated=1.0)
    line = ("upload", weak(tmp_path / "weak.param", credit), "--yes")
    assert run(*line, "--accept-implausible", "FF1_T1_GAIN") == exit_codes.DONE
    capsys.readouterr()
    assert run(*line) == exit_codes.DONE
    said = " ".join(capsys.readouterr().out.split())
    assert "nothing to do" in said
    warning = "warning: the vehicle holds FF1_T1_GAIN: thruster 1 is made up for already: the vehicle's own"
    assert (warning in said) == by_itself
    assert vehicle.server.active(1)["T1_gain"] == pytest.approx(0.8)


def test_an_effect_that_is_taken_back_is_no_gain_beside_another(vehicle, tmp_path):
    path = tmp_path / "none.param"
    weak(path, BY_ITSELF)
    write_parameters(path, {"FF1_M_U": 111.5, "FF1_D_U": 56.25, "FF1_T1_GAIN": 0.0})
    vehicle.server.write("FF1_T1_GAIN", 0.8, armed=False)
    assert run("upload", str(path), "--yes") == exit_codes.DONE
    assert "T1_gain" not in vehicle.server.active(1)
