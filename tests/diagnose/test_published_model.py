"""A dive held against published numbers: the model of a vehicle file, quadratic drag included."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
import yaml
from soak import rows_rest_in_soak

from bridge import exit_codes
from bridge.errors import ConfigError
from bridge.simulator.truth import load_truth
from bridge.vehicle.coefficients import QUADRATIC_NAMES
from bridge.vehicle.config import Configuration, Prior, load_vehicle
from bridge.vehicle.parameters import vehicle_table
from identify.challenge.case import dive_of, draw_case
from identify.challenge.tlog import tlog_of
from identify.diagnose.result import Value
from identify.export.model import model_of
from identify.run.diagnose import LEAST_DRAG, contradicted, published
from tui import cli

SHAPE = Configuration(10.0, (1.0, 1.0, 1.0), (), damping="both")
QUADRATIC = ("X_uu", "Y_vv", "Z_ww", "K_pp", "M_qq", "N_rr")


def with_model(model, damping="both", **more):
    return replace(SHAPE, damping=damping, model=model, **more)


def test_each_number_is_known_to_the_share_that_the_file_says():
    values = published(with_model({"M_u": 20.0, "D_u": 5.0, "X_uu": 40.0}, model_std=0.2), "both").values
    assert {name: (prior.value, prior.std) for name, prior in values.items()} == {
        "M_u": (20.0, 4.0), "D_u": (5.0, 1.0), "X_uu": (40.0, 8.0),
    }  # fmt: skip


def test_of_two_drags_one_that_is_left_out_or_zero_is_none_and_what_is_not_stated_is_held_against_nothing():
    values = published(
        with_model({"M_u": 20.0, "X_uu": 40.0, "D_r": 3.0, "N_rr": 0.0, "D_v": 0.0}), "both"
    ).values
    assert set(values) == {"M_u", "D_u", "X_uu", "D_r", "N_rr", "D_v"}
    assert values["D_u"].value == values["N_rr"].value == 1e-9


def test_a_drag_that_the_hull_of_the_dive_lacks_is_refused_and_so_is_a_file_without_numbers():
    with pytest.raises(ConfigError, match=r"has X_uu, and the hull of the dive has damping: linear; write"):
        published(with_model({"M_u": 20.0, "X_uu": 40.0}), "linear")
    with pytest.raises(ConfigError, match=r"has D_u, and the hull of the dive has damping: quadratic"):
        published(with_model({"M_u": 20.0, "D_u": 4.0}), "quadratic")
    with pytest.raises(ConfigError, match="has no model: write the published numbers there"):
        published(SHAPE, "both")


SEED = 300_932


@pytest.fixture(scope="module")
def published_case(tmp_path_factory):
    """Diagnose a dive with a published model whose quadratic drag is a share of the true one; returns its JSON."""
    folder = tmp_path_factory.mktemp("published")
    case = draw_case(SEED, names=["quadratic_drag"], seconds=150.0)
    (folder / "dive.tlog").write_bytes(tlog_of(dive_of(case)))
    truth = case.truth()
    drag = truth["effects"][0]["parameters"]

    def file_with(share, name="our.yaml", **shape):
        data = yaml.safe_load(case.vehicle.text)
        model = {key: value for key, value in truth["nominal"].items() if value > 0}
        model |= {key: share * drag[key] for key in QUADRATIC if key in drag}
        data["configurations"][case.configuration] |= {"damping": "both", "model": model} | shape
        path = folder / name
        path.write_text(yaml.safe_dump(data), encoding="utf-8")
        return path

    def run(share):
        path = file_with(share)
        data = yaml.safe_load(path.read_text(encoding="utf-8"))
        data["configurations"] = {"paper": data["configurations"][case.configuration]}
        paper = folder / "paper.yaml"
        paper.write_text(yaml.safe_dump(data), encoding="utf-8")
        words = ["diagnose", folder / "dive.tlog", "--vehicle", path, "--json", folder / "gap.json"]
        assert cli.main([*map(str, words), "--accepted", f"{paper}:paper"]) == exit_codes.DONE
        return json.loads((folder / "gap.json").read_text(encoding="utf-8"))

    return folder, case, file_with, run


@pytest.mark.parametrize(("share", "causes"), rows_rest_in_soak([(0.4, ["fouling"]), (1.0, [])]))
def test_the_gap_is_that_of_the_published_numbers_with_their_quadratic_drag(published_case, share, causes):
    _, _, _, run = published_case
    answer = run(share)
    assert [effect["name"] for effect in answer["effects"]] == causes
    assert (answer["gap"]["before"] > 2.0) is bool(causes)
    notes = " ".join(answer["told"]["notes"])
    assert ("the dive contradicts X_uu 27.8 (the dive: 72.4" in notes) is bool(causes)
    assert "M_u" not in notes


def test_a_number_is_contradicted_beyond_what_both_are_known_to():
    held = {
        "M_u": Prior(20.0, 3.0),
        "X_uu": Prior(LEAST_DRAG, LEAST_DRAG),
        "D_v": Prior(5.0, 0.1),
        "Y_vv": Prior(9.0, 1.0),
    }
    numbers = {
        "M_u": Value(27.0, "kg", 23.0, 31.0), "X_uu": Value(40.0, "N s2/m2", 38.0, 42.0),
        "D_v": Value(5.1, "N s/m", 5.0, 5.2),
    }  # fmt: skip
    (said,) = contradicted(held, numbers)
    assert (
        said
        == "Of the numbers of the model before, the dive contradicts X_uu 0 (the dive: 40.0, 38.0 to 42.0 N s²/m²)."
    )
    assert contradicted(held, {"M_u": numbers["M_u"]}) == ()
    assert "M_u 20.0 (the dive: 27.4" in contradicted(held, {"M_u": Value(27.4, "kg", 23.4, 31.4)})[0]


@pytest.mark.parametrize(
    ("accepted", "says"),
    [
        ("absent.yaml", "no such file"),
        ("our.yaml:other", "has no configuration 'other'; it has"),
        ("bare.yaml", "has no model: write the published numbers there"),
    ],
)
def test_a_file_that_can_not_be_held_against_a_dive_is_named_with_what_to_do(
    published_case, accepted, says, capsys
):
    folder, _, file_with, _ = published_case
    file_with(1.0)
    file_with(1.0, "bare.yaml", model={})
    words = [
        "diagnose",
        folder / "dive.tlog",
        "--vehicle",
        folder / "our.yaml",
        "--accepted",
        folder / accepted,
    ]
    assert cli.main(list(map(str, words))) == exit_codes.BAD_INPUT
    said = capsys.readouterr().err
    assert f"--accepted {folder / accepted}: " in said
    assert says in said


MODEL = load_vehicle("bluerov2_heavy").vehicle.configurations["heavy"].model


def heavy(folder, **shape) -> Path:
    """The bundled ROV, less its quadratic drag, with a `shape` of another kind."""
    data = yaml.safe_load(load_vehicle("bluerov2_heavy").path.read_text(encoding="utf-8"))
    linear = {name: value for name, value in MODEL.items() if name not in QUADRATIC_NAMES}
    data["configurations"]["heavy"] |= {"damping": "linear", "model": linear} | shape
    path = folder / "heavy.yaml"
    path.write_text(yaml.safe_dump(data), encoding="utf-8")
    return path


def test_simulator_feed_forward_and_export_take_the_files_quadratic_drag(tmp_path):
    linear = {name: value for name, value in MODEL.items() if name not in QUADRATIC_NAMES}
    file = load_vehicle(str(heavy(tmp_path, damping="both", model=linear | {"X_uu": 141.0})))
    assert load_truth(file, "heavy").quadratic == (141.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert {row.coefficient: row.default for row in vehicle_table(file.vehicle)}["X_uu"] == 141.0
    assert model_of({"M_u": 20.0}, file, "heavy").quadratic[0] == 141.0
    identified = model_of({"M_u": 20.0, "D_u": 30.0}, file, "heavy")
    assert (identified.linear[0], identified.quadratic[0]) == (30.0, 0.0)


def test_quadratic_drag_needs_a_hull_that_has_it_and_a_value_that_it_can_have(tmp_path):
    with pytest.raises(
        ConfigError, match="model: X_uu is quadratic drag, which a hull with damping: linear does not"
    ):
        load_vehicle(str(heavy(tmp_path, model={"X_uu": 141.0})))
    with pytest.raises(ConfigError, match="model_std must be above 0"):
        load_vehicle(str(heavy(tmp_path, model_std=0.0)))
    huge = load_vehicle(str(heavy(tmp_path, damping="both", model={"X_uu": 1e6})))
    with pytest.raises(ConfigError, match="model: X_uu is 1e"):
        vehicle_table(huge.vehicle)
