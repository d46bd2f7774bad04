"""The truth in the library's words: the size of its own form that comes nearest to what is planted."""

import numpy as np
import pytest

from identify.challenge.case import Case, draw_case
from identify.challenge.nearest import missing_wrench, nominal_columns

SEED, SECONDS = 310_900, 90.0


def drawn(*names: str) -> Case:
    return draw_case(SEED, names=names, size=0.6, seconds=SECONDS)


def told(case: Case, k: int = 0) -> dict[str, float]:
    parameters: dict[str, float] = case.truth()["effects"][k]["parameters"]
    return parameters


def test_an_offset_of_mass_is_told_in_metres_whether_of_the_body_or_of_the_water() -> None:
    case = drawn("cg_offset")
    site, _ = case.simulated(0)
    moment = float((site.rigid + site.added)[1, 5])
    mass = case.vehicle.configuration.dry_mass_kg
    assert told(case)["x"] == pytest.approx(moment / mass, rel=1e-3)


def test_more_drag_astern_is_told_as_how_many_times_as_much() -> None:
    case = drawn("drag_asymmetry")
    assert told(case)["ratio"] == pytest.approx(case.planted[0].parameters["ratio"], rel=0.01)
    assert told(case)["ratio"] > 1.1


def test_no_other_square_drag_comes_nearer_to_what_is_planted_beside_a_refit() -> None:
    case = drawn("quadratic_drag")
    site, simulated = case.simulated(0)
    nu, std = simulated.ticks.state[:, 7:13], site.vehicle.disturbance
    columns = (nominal_columns(nu, simulated.ticks.nu_dot) / std[None, :, None]).reshape(-1, 12)
    gap, values = missing_wrench(site, simulated), np.array([*told(case).values()])

    def left(size: np.ndarray) -> float:
        rest = ((gap + size * nu * np.abs(nu)) / std).reshape(-1)
        return float(np.sum((rest - columns @ np.linalg.lstsq(columns, rest, rcond=None)[0]) ** 2))

    nearest = left(values)
    for factor in (0.97, 1.03):
        for dof in (0, 1, 2, 5):
            other = values.copy()
            other[dof] *= factor
            assert left(other) > nearest


def test_of_several_forms_the_nearest_tells_and_names_its_thruster() -> None:
    case = drawn("weak_thruster")
    assert told(case)["thruster"] == case.planted[0].number
    assert told(case)["gain"] == pytest.approx(case.planted[0].parameters["gain"], abs=0.03)


def test_wrong_readings_are_told_as_they_are_planted_and_beside_them_a_force_by_its_own() -> None:
    case = drawn("dvl_bias", "net_buoyancy")
    assert told(case) == case.planted[0].parameters
    assert told(case, 1)["force"] == pytest.approx(case.planted[1].parameters["force"], rel=0.05)


def test_a_current_that_comes_and_goes_is_told_by_the_sine_of_its_power() -> None:
    case = drawn("varying_current")
    site, _ = case.simulated(0)
    water = site.moving_water()[:, :2]
    assert told(case)["amplitude"] == pytest.approx(np.sqrt(2 * water.var(axis=0).sum()))
    assert told(case)["period"] == case.planted[0].parameters["period"]


def test_waves_push_with_their_mass_times_rate_at_least() -> None:
    case = drawn("waves")
    amplitude = told(case)["force_amplitude"]
    assert 0.5 < amplitude / case.planted[0].parameters["force_amplitude"] < 2.5
