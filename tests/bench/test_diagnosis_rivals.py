"""The rivals of the diagnosis name what their means can show, and their models fly."""

from importlib.util import find_spec

import numpy as np
import pytest

from bench.diagnosis.plan import Planned
from bench.diagnosis.rivals import bic, network
from bench.diagnosis.rivals.closing import closed
from bench.diagnosis.rivals.said import Said, missing, pushing
from bench.diagnosis.rivals.terms import terms
from bench.diagnosis.rivals.trials import trials
from identify.challenge.case import check_of, dive_of, draw_case
from identify.diagnose.nominal import Nominal, nominal_of
from identify.effects.hydrodynamics import COUPLED_DAMPING, QUADRATIC_DRAG


@pytest.fixture(scope="module")
def pair() -> tuple[Nominal, Nominal]:
    case = draw_case(390_800, names=["quadratic_drag"], size=1.0, seconds=120.0)
    dive, check = (nominal_of(one, case.file, case.configuration) for one in (dive_of(case), check_of(case)))
    return dive, check


def test_bic_names_the_one_effect_that_saves_most(pair: tuple[Nominal, Nominal]) -> None:
    said = bic.named(pair[0], (COUPLED_DAMPING, QUADRATIC_DRAG))
    assert said.names == (("quadratic_drag", 0),)


def test_bic_names_none_where_none_pays_for_its_parameters(pair: tuple[Nominal, Nominal]) -> None:
    bare = bic.named(pair[0], (QUADRATIC_DRAG,)).now
    assert bic.named(bare, (QUADRATIC_DRAG,)).names == ()


if find_spec("pysindy") is not None:  # it comes with the optional extra `bench`

    def test_the_sparse_regression_keeps_the_terms_that_push_and_names_them() -> None:
        from bench.diagnosis.rivals import sindy

        rng = np.random.default_rng(1)
        columns = rng.standard_normal((2000, 6))
        sizes = sindy.sparse(
            columns, 2.0 * columns[:, 3] + 0.1 * columns[:, 1] + 0.5 * rng.standard_normal(2000)
        )
        assert np.flatnonzero(sizes).tolist() == [3]
        assert sizes[3] == pytest.approx(2.0, rel=0.15)
        case = draw_case(300_114, names=["steady_current"])
        said = sindy.named(nominal_of(dive_of(case), case.file, case.configuration))
        assert said.names[0] == ("steady_current", 0)


def test_the_network_shrinks_the_gap_of_a_dive_that_is_long_enough_and_names_nothing() -> None:
    case = draw_case(390_801, names=["quadratic_drag"], size=1.0, seconds=240.0)
    nominal = nominal_of(dive_of(case), case.file, case.configuration)
    said = network.named(nominal)
    assert said.names == ()
    before, after = closed(said, nominal, nominal)
    assert np.nansum(after**2) < 0.8 * np.nansum(before**2)


def test_a_model_of_nothing_leaves_the_drift_as_it_is_and_the_right_cause_closes_it(
    pair: tuple[Nominal, Nominal],
) -> None:
    nothing = Said((), (pushing("nothing", lambda course: np.zeros_like(course.nu)),), pair[0])
    before, after = closed(nothing, *pair)
    assert after == pytest.approx(before, rel=0.02, nan_ok=True)
    before, after = closed(bic.named(pair[0], (QUADRATIC_DRAG,)), *pair)
    assert after[5] < 0.5 * before[5]


def test_the_missing_force_of_a_drag_goes_against_its_speed(pair: tuple[Nominal, Nominal]) -> None:
    gap, nu = missing(pair[0]), pair[0].motion.nu
    speed = nu[gap.at, 5]
    curved = speed * np.abs(speed) - speed * (np.abs(speed) @ speed**2) / (speed @ speed)
    assert np.corrcoef(gap.wrench[:, 5], curved)[0, 1] < -0.3


def test_every_term_that_names_an_effect_is_finite_along_a_dive(pair: tuple[Nominal, Nominal]) -> None:
    course = pair[0].course
    for dof in range(6):
        table = list(terms(course, dof))
        assert len(table) > 10
        assert all(np.isfinite(force).all() and force.shape == course.time_s.shape for _, force in table)


def test_a_rivals_trial_survives_its_json() -> None:
    planned = Planned("one", 1, "one", ("waves",))
    data = {
        "truth": {"name": planned.name},
        "rivals": {"BIC, one cause": {"names": [["weak_thruster", 3]], "seconds": 1.0, "drifts": []}},
    }
    (one,) = trials(data)
    assert one.answer.verdict == "explained"
    assert one.answer.named[0].parameters["thruster"][0] == 3.0
    assert one.before == ()
