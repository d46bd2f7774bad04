"""What the fit beside accepted causes still gets wrong goes with the values: as doubts, and in their intervals."""

from dataclasses import replace

import numpy as np
import pytest

from identify.diagnose import accepted
from identify.diagnose.accepted import accepted_of
from identify.diagnose.candidates import Cause
from identify.diagnose.result import Finding, Value
from identify.effects import actuators, hydrodynamics
from identify.estimators.misfit import Doubts, Multiplier
from identify.identification import Outcome

SURGE, YAW, OF_MASS, OF_DAMPING = 0, 5, 0, 6
FITS = Multiplier(0.0, 0.0, np.zeros(18))


@pytest.fixture
def fit(monkeypatch):
    """A switch: what the tests of the fit say, by degree of freedom."""

    def says(**doubts):
        found = {SURGE: Doubts(doubts.get("drag", FITS), doubts.get("late", FITS)), YAW: Doubts(FITS, FITS)}
        monkeypatch.setattr(accepted, "doubts_of", lambda _joint, _theta: found)

    return says


def changing(score, size, row, by):
    """A force of this size that changes one logarithm by so much."""
    leaning = np.zeros(18)
    leaning[row] = by / size
    return Multiplier(score, size, leaning)


def drag(**coefficients):
    values = [coefficients.get(name, 0.0) for name in ("X_uu", "Y_vv", "Z_ww", "K_pp", "M_qq", "N_rr")]
    told = {name: Value(size, "N s2/m2", 0.9 * size, 1.1 * size) for name, size in coefficients.items()}
    return Finding(Cause(hydrodynamics.QUADRATIC_DRAG, np.array(values)), (), {}, 0.98, told, 50.0)


ASTERN = Finding(
    Cause(actuators.REVERSE_THRUST_LOSS, np.array([0.7])), (), {}, 0.98, {"gain": Value(0.7, "1", 0.6, 0.8)}, 50.0
)  # fmt: skip


def test_a_fit_that_nothing_speaks_against_has_no_doubts(nominal, shape, fit):
    fit()
    assert accepted_of((ASTERN,), nominal, shape).doubts == ()


def test_thrust_that_acts_late_beside_the_causes_is_a_doubt_of_its_axis_and_widens_it(nominal, shape, fit):
    fit()
    before = accepted_of((ASTERN,), nominal, shape).values
    fit(late=changing(8.0, 0.02, OF_MASS, 0.1))
    accepted = accepted_of((ASTERN,), nominal, shape)
    (doubt,) = accepted.doubts
    assert {"M_u", "D_u"} <= set(doubt.about)
    assert doubt.outcome is Outcome.DISAGREES
    assert "later, by about 20 ms" in doubt.sentence
    value, low = accepted.values["M_u"].value, accepted.values["M_u"].low95
    assert value == before["M_u"].value
    own = np.log(before["M_u"].value / before["M_u"].low95)
    assert np.log(value / low) == pytest.approx(np.hypot(own, 1.96 * 0.1), rel=1e-3)
    assert accepted.values["M_v"] == before["M_v"]


def test_a_drag_that_lacks_is_the_doubt_that_an_identification_has_of_it(nominal, shape, fit):
    fit(drag=changing(9.0, 3.0, OF_DAMPING, -0.3))
    (doubt,) = accepted_of((ASTERN,), nominal, shape).doubts
    assert (doubt.about, doubt.outcome) == (("M_u", "D_u"), Outcome.DISAGREES)
    assert "grows as the speed squared is missing" in doubt.sentence


def test_linear_damping_that_quadratic_drag_may_replace_begins_at_none(nominal, shape, fit):
    fit(drag=changing(9.0, 3.0, OF_DAMPING, -0.9))
    accepted = accepted_of((drag(X_uu=40.0),), nominal, shape)
    (doubt,) = accepted.doubts
    assert (doubt.about, doubt.outcome) == (("D_u",), Outcome.CONVERGED)
    assert "more quadratic drag than was accepted and less linear damping" in doubt.sentence
    told = accepted.values["D_u"]
    assert told.low95 == 0.0
    assert told.high95 > told.value * (1.0 + 1.96 * 0.9)
    assert accepted.values["D_v"].low95 > 0.0


def test_an_axis_whose_thrust_follows_what_was_not_recorded_is_not_called_late(nominal, shape, fit):
    fit(late=changing(8.0, 0.02, OF_MASS, 0.1))
    assert accepted_of((ASTERN,), replace(nominal, doubted=(SURGE,)), shape).doubts == ()
