from pathlib import Path

import pytest

from bridge.errors import ConfigError
from bridge.simulator.truth import Truth, load_truth
from bridge.vehicle.config import load_vehicle

FILE = load_vehicle("ruvifist")
BLUEROV2 = Path(__file__).resolve().parents[1] / "data" / "vehicles" / "bluerov2.yaml"


def test_the_papers_figures_are_taken_for_added_mass_on_top_of_72_kg() -> None:
    survey, hovering = load_truth(FILE, "survey"), load_truth(FILE, "hovering")
    assert survey.model["M_u"] == pytest.approx(72 + 24.4)
    assert (survey.model["D_u"], survey.model["D_r"]) == (42.13, 21.8)
    assert hovering.mass == (111.6, 112.41, 134.0, 5.2, 15.5, 16.0)
    assert hovering.damping == (56.24, 53.05, 95.0, 18.0, 26.0, 26.07)


def test_the_total_is_nowhere_less_than_the_rigid_body() -> None:
    for name, shape in FILE.vehicle.configurations.items():
        rigid = (shape.dry_mass_kg,) * 3 + shape.inertia_kgm2
        assert all(total > body for total, body in zip(load_truth(FILE, name).mass, rigid, strict=True))


def test_a_vehicle_without_a_truth_is_told_what_is_missing() -> None:
    with pytest.raises(ConfigError, match=r"bluerov2\.truth\.yaml.*M_u"):
        load_truth(load_vehicle(str(BLUEROV2)), "bluerov2")


def test_a_complete_model_in_the_vehicle_file_serves_as_truth(tmp_path: Path) -> None:
    model = load_truth(FILE, "hovering").model
    text = BLUEROV2.read_text() + "    model: {" + ", ".join(f"{k}: {v}" for k, v in model.items()) + "}\n"
    (tmp_path / "mine.yaml").write_text(text)
    truth = load_truth(load_vehicle(str(tmp_path / "mine.yaml")), "bluerov2")
    assert truth.model == model
    assert truth.disturbance_n == pytest.approx(0.35 * 13.5 / 72)


@pytest.mark.parametrize("change", [{"M_u": -1.0}, {"Z_z": 1.0}])
def test_a_truth_outside_the_list_or_its_bounds_is_refused(change: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(change))):
        Truth(load_truth(FILE, "survey").model | change, 0.0, 0.0)


def test_a_truth_may_hold_effects_that_the_simulator_has_and_no_others() -> None:
    model = load_truth(FILE, "hovering").model
    assert Truth(model, 0.0, 0.0, effects={"X_uu": 60.0, "T2_gain": 0.8}).quadratic == (60.0, 0, 0, 0, 0, 0)
    with pytest.raises(ValueError, match="'N_munk' can't be simulated"):
        Truth(model, 0.0, 0.0, effects={"N_munk": 1.0})
    with pytest.raises(ValueError, match="X_uu is -1"):
        Truth(model, 0.0, 0.0, effects={"X_uu": -1.0})
