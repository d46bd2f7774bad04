"""A cause that may as well be absent, by the interval that it is told with, is none; one that is sure stays."""

from dataclasses import replace

import numpy as np
import pytest

from identify.challenge.case import dive_of, draw_case
from identify.diagnose import confidence as module
from identify.diagnose.candidates import Cause
from identify.diagnose.confidence import chi_squared, covariance_of, without_doubtful
from identify.diagnose.nominal import nominal_of
from identify.diagnose.search import explain
from identify.effects.environment import waves
from identify.effects.hydrodynamics import QUADRATIC_DRAG
from identify.effects.rigid_body import NET_BUOYANCY

LIBRARY = (NET_BUOYANCY, QUADRATIC_DRAG)

covariance_beside = module._covariance


@pytest.fixture(scope="module")
def heavy():
    """A dive of a heavy vehicle: the filters without a cause, and the cause."""
    case = draw_case(300_921, names=["net_buoyancy"], size=0.8, seconds=120.0, rpm=False)
    nominal = nominal_of(dive_of(case), case.file, next(iter(case.file.vehicle.configurations)))
    return nominal, explain(nominal, LIBRARY, lambda *_report: None)


def test_a_cause_that_the_dive_tells_from_none_stays(heavy):
    nominal, found = heavy
    assert [cause.effect for cause in found.causes] == [NET_BUOYANCY]
    left, covariance = without_doubtful(found, nominal, LIBRARY)
    assert left is found
    assert covariance == pytest.approx(covariance_of(found.weighing, found.fit))


def test_a_cause_whose_interval_holds_its_absence_is_dropped_and_the_filters_are_as_without_it(
    heavy, monkeypatch
):
    nominal, found = heavy
    (size,) = found.causes[0].values
    monkeypatch.setattr(module, "is_certain", lambda _: False)
    wide = (size / covariance_of(found.weighing, found.fit)[0, 0] ** 0.5) ** 2
    for factor, stays in ((wide / 4.0, True), (wide / 3.5, False)):
        monkeypatch.setattr(module, "_covariance", lambda *of, by=factor: by * covariance_beside(*of))
        left, covariance = without_doubtful(found, nominal, LIBRARY)
        assert (bool(left.causes), len(covariance)) == (stays, int(stays))
    assert left.now.theta == pytest.approx(nominal.theta, rel=0.02, abs=0.05)


def test_a_lone_cause_that_is_certain_stays_however_wide_its_interval(heavy, monkeypatch):
    nominal, found = heavy
    assert found.fit.gain > 200.0
    monkeypatch.setattr(module, "_covariance", lambda *of: 1e9 * covariance_beside(*of))
    left, _ = without_doubtful(found, nominal, LIBRARY)
    assert left is found


def test_of_causes_that_may_both_be_absent_the_one_that_saves_less_goes_first(heavy, monkeypatch):
    """However wide the interval of the one that casts the shadow."""
    nominal, found = heavy
    fit = found.weighing.fitted((*found.causes, Cause(QUADRATIC_DRAG, QUADRATIC_DRAG.start())))
    tried = []

    def refitted(causes, *_):
        tried.append([cause.effect for cause in causes])
        return replace(found, fit=found.weighing.fitted(()))

    monkeypatch.setattr(module, "explained_by", refitted)
    monkeypatch.setattr(module, "_covariance", lambda *_: np.eye(7))
    monkeypatch.setattr(
        module, "_confidence", lambda of, _, k: 0.1 if of.causes[k].effect is NET_BUOYANCY else 0.5
    )
    without_doubtful(replace(found, fit=fit), nominal, LIBRARY)
    assert tried == [[NET_BUOYANCY]]


def test_a_moment_stays_though_its_gain_is_over_masses_that_hardly_differ(heavy, monkeypatch):
    """The interval of a gain over a difference of masses can hold anything; that the moment is there is another
    question."""
    nominal, found = heavy

    def of_masses(weighing, _causes):
        size = float(np.sqrt((found.fit.slopes**2).sum()))
        nominal = weighing.rows.nuisance
        dense = np.hstack([nominal.dense()[:, 1:], found.fit.slopes + 1e-3 * size])
        return nominal.blocks_of(dense)

    monkeypatch.setattr(module, "coupled_nominal", of_masses)
    left, covariance = without_doubtful(found, nominal, LIBRARY)
    assert left is found
    (size,) = found.causes[0].values
    assert size < 2.0 * covariance[0, 0] ** 0.5


def test_a_sea_stays_though_parts_of_the_dive_disagree_on_its_lines(monkeypatch):
    case = draw_case(300_911, names=["waves"], size=0.7, seconds=200.0)
    nominal = nominal_of(dive_of(case), case.file, next(iter(case.file.vehicle.configurations)))
    found = explain(nominal, (waves(5.0),), lambda *_report: None)
    assert [cause.effect.name for cause in found.causes] == ["waves"]
    monkeypatch.setattr(module, "_covariance", lambda *of: 1e9 * covariance_beside(*of))
    assert without_doubtful(found, nominal, (waves(5.0),))[0] is found


@pytest.mark.parametrize("freedom", [1, 2, 3, 6, 7, 24])
def test_the_confidence_of_a_distance_is_that_of_chi_squared(freedom):
    from scipy.special import chdtr

    for at in (-1.0, 0.0, 1e-3, 0.5, 3.84, 12.0, 80.0):
        assert chi_squared(freedom, at) == pytest.approx(float(chdtr(freedom, max(at, 0.0))), abs=1e-12)
