"""Dives with hidden effects: what they are, what they hold, and that nothing hides where nothing is planted."""

import json
from pathlib import Path

import numpy as np
import pytest

from bridge.vehicle.config import load_vehicle
from identify.challenge.case import Case, check_of, dive_of, draw_case
from identify.challenge.nearest import missing_velocity, missing_wrench
from identify.challenge.novel import NOVEL
from identify.challenge.plants import PLANTS
from identify.challenge.recording import tlog_of
from identify.estimators.table import estimator
from identify.ingest.open import read_dive

SCHEMA = Path(__file__).resolve().parents[1] / "data" / "answers.schema.json"
SEED = 100_011


@pytest.fixture(scope="module")
def honest() -> Case:
    return draw_case(SEED, names=[], seconds=150.0)


def test_a_vehicle_that_hides_nothing_moves_by_its_nominal_model_alone(honest: Case) -> None:
    for which in (0, 1):
        site, simulated = honest.simulated(which)
        assert np.abs(simulated.ticks.nu_dot).max() > 0.1
        assert np.abs(missing_wrench(site, simulated)).max() < 1e-9
        assert np.abs(missing_velocity(site, simulated)).max() < 1e-12


def test_its_attitude_stays_a_rotation(honest: Case) -> None:
    attitude = honest.simulated(0)[1].ticks.state[:, 3:7]
    assert np.linalg.norm(attitude, axis=1) == pytest.approx(np.ones(len(attitude)), abs=1e-12)


def test_its_controller_follows_the_mission(honest: Case) -> None:
    state = honest.simulated(0)[1].ticks.state
    reference = dive_of(honest).nu_ref
    assert reference is not None
    assert np.std(reference.value[:, 0]) > 0.1
    assert np.std(state[:, 7] - reference.value[:, 0]) < 0.5 * np.std(reference.value[:, 0])


def test_a_recording_opens_as_the_dive_that_it_was_made_from(honest: Case, tmp_path: Path) -> None:
    (tmp_path / "vehicle.yaml").write_text(honest.vehicle.text, encoding="utf-8")
    (tmp_path / "dive.tlog").write_bytes(tlog_of(dive_of(honest)))
    file = load_vehicle(str(tmp_path / "vehicle.yaml"))
    assert file.vehicle == honest.file.vehicle
    read, made = read_dive(tmp_path / "dive.tlog", vehicle=file), dive_of(honest)
    assert set(read.signals()) == set(made.signals())
    for name, signal in made.signals().items():
        other = read.signals()[name]
        width = signal.value.shape[1]
        assert len(other) == len(signal), name
        assert np.abs(other.time_s - signal.time_s).max() < 2e-3, name
        assert np.allclose(other.value[:, :width], signal.value, rtol=1e-5, atol=6e-3, equal_nan=True), name


def test_its_masses_are_identified_from_the_recording(honest: Case, tmp_path: Path) -> None:
    (tmp_path / "vehicle.yaml").write_text(honest.vehicle.text, encoding="utf-8")
    (tmp_path / "dive.tlog").write_bytes(tlog_of(dive_of(honest)))
    file = load_vehicle(str(tmp_path / "vehicle.yaml"))
    dive = read_dive(tmp_path / "dive.tlog", vehicle=file)
    fit = estimator("likelihood")(dive, file, honest.configuration, lambda *_: None)
    told = {one.name: one for one in fit.parameters}
    truth = honest.truth()["nominal"]
    for name in ("M_u", "M_v", "M_w", "I_r"):
        value, std = told[name].value, told[name].std
        assert value is not None
        assert std is not None
        assert std < 0.1 * value
        assert abs(value - truth[name]) < 4 * std, name


def test_a_seed_gives_the_same_case_again() -> None:
    one, two = (draw_case(SEED + 1, seconds=20.0) for _ in range(2))
    assert one.truth() == two.truth()
    assert dive_of(one).sha256 == dive_of(two).sha256


def test_of_two_effects_each_has_a_size_of_its_own() -> None:
    pair = draw_case(SEED + 1, names=["quadratic_drag", "dvl_bias"], size=0.5, seconds=20.0)
    alone = draw_case(SEED + 1, names=["quadratic_drag"], size=0.5, seconds=20.0)
    drag, bias = (effect["size"] for effect in pair.truth()["effects"])
    assert drag == alone.truth()["size"] == alone.truth()["effects"][0]["size"]
    assert 0 < bias != drag


def test_the_check_is_another_mission_with_the_same_effect() -> None:
    case = draw_case(SEED + 2, names=["quadratic_drag"], size=0.5, seconds=20.0)
    assert dive_of(case).sha256 != check_of(case).sha256
    assert np.array_equal(case.simulated(0)[0].hull.drag, case.simulated(1)[0].hull.drag)


@pytest.mark.parametrize("name", [*PLANTS, *NOVEL])
def test_every_effect_can_be_planted_and_larger_ones_show_more(name: str) -> None:
    small, large = (draw_case(SEED + 3, names=[name], size=size, seconds=30.0) for size in (0.0, 1.0))
    for case in (small, large):
        assert np.isfinite(case.simulated(0)[1].ticks.state).all()
        json.dumps(case.truth(), allow_nan=False)
    unseen = name in ("added_payload", "dvl_scale", "entrained_water", "thrust_gain", "wrong_feedback_log")
    if not unseen:
        assert large.truth()["size"] > small.truth()["size"] > 0
    assert np.abs(large.simulated(0)[1].ticks.state[:, 7:13]).max() < 3.0


@pytest.mark.parametrize("name", ["entrained_water", "added_payload"])
def test_what_a_refit_takes_up_leaves_nothing(name: str) -> None:
    assert draw_case(SEED + 4, names=[name], size=1.0, seconds=60.0).truth()["size"] < 1e-9


def test_a_wrong_dvl_scale_leaves_no_more_than_what_turning_adds_at_its_place() -> None:
    assert draw_case(SEED + 4, names=["dvl_scale"], size=1.0, seconds=60.0).truth()["size"] < 0.3


def test_there_is_a_plant_for_every_name_that_an_answer_may_give() -> None:
    schema = json.loads(SCHEMA.read_text(encoding="utf-8"))
    names = schema["properties"]["effects"]["items"]["properties"]["name"]["enum"]
    assert set(PLANTS) == set(names)
    parameters = schema["$defs"]["parameters_of_each_effect"]
    for name in names:
        truth = draw_case(SEED, names=[name], size=0.5).planted[0].parameters
        assert set(truth) == set(parameters[name]), name


def test_all_kinds_are_drawn() -> None:
    cases = [draw_case(200_000 + seed) for seed in range(60)]
    assert {case.kind for case in cases} == {"none", "one", "two", "novel"}
    assert len({case.configuration for case in cases}) == 3
    assert all(len({p.name for p in case.planted}) == len(case.planted) for case in cases)
