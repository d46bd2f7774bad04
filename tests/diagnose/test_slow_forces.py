"""A slow force is told as one, though the fitted disturbance follows it; a sea's own disturbance is not."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from identify.challenge.case import Case, dive_of, draw_case
from identify.challenge.site import Planted, Site
from identify.diagnose import slow
from identify.diagnose.nominal import Nominal
from identify.diagnose.recording import fitted_nominal
from identify.diagnose.slow import slow_axes, slow_forces
from identify.diagnose.unexplained import UNKNOWN_NATS, unexplained_of
from identify.diagnose.weighing import weighing_of
from identify.estimators.likelihood_axis import TIME_CONSTANT

Array = NDArray[np.float64]
PERIOD_S = 90.0


def pushed(time_s: Array, vehicle_nm: float) -> Array:
    """Slow, with no period and no end: two turns that never come back in step."""
    return vehicle_nm * (np.sin(2 * np.pi * time_s / PERIOD_S) + np.sin(2.7 * np.pi * time_s / PERIOD_S))


def fitted(case: Case) -> Nominal:
    return fitted_nominal(dive_of(case), case.file, case.configuration)


def time_s(now: Nominal, dof: int) -> float:
    """The correlation time that was fitted to an axis's disturbance."""
    problems = zip(now.joint.problems, now.joint.places, strict=True)
    (place,) = [place for problem, place in problems if problem.axis.dof == dof]
    return float(np.exp(now.theta[place][TIME_CONSTANT]))


@pytest.fixture(scope="module")
def quiet() -> Case:
    return draw_case(391_518, kind="none", seconds=300.0)


def test_the_disturbance_of_a_sea_is_not_slow(quiet: Case) -> None:
    assert all(one.gain < UNKNOWN_NATS for one in slow_forces(fitted(quiet)))


def test_a_smoother_sea_that_forgets_as_soon_is_not_slow() -> None:
    now = fitted(draw_case(430_060, kind="none"))
    yaw, others = time_s(now, 5), [time_s(now, dof) for dof in (0, 1, 2)]
    assert yaw > 2 * max(others)
    assert 5 not in slow_axes(now)


def with_times(now: Nominal, times_s: dict[int, float]) -> Nominal:
    """The same filters with other correlation times by degree of freedom."""
    theta = now.theta.copy()
    for problem, place in zip(now.joint.problems, now.joint.places, strict=True):
        theta[place.start + TIME_CONSTANT] = np.log(times_s[problem.axis.dof])
    return replace(now, theta=theta)


def test_a_memory_that_is_held_behind_a_filter_tells_nothing_of_the_sea(
    quiet: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(slow, "_forgets", lambda *_: False)
    now = fitted(quiet)
    filtered = with_times(now, {dof: 1.5 if dof < 3 else 5.5 for dof in range(6)})
    assert set(slow_axes(filtered)) == {3, 4, 5} & {p.axis.dof for p in now.joint.problems}
    assert slow_axes(replace(filtered, filtered=(0, 1, 2))) == {}


def test_a_dive_that_is_short_beside_the_sea_shows_no_slow_force(quiet: Case) -> None:
    now = fitted(quiet)
    lasting_s = float(now.course.since_s[-1])
    rising = np.linspace(-1.0, 1.0, len(now.course.time_s))
    assert not slow._forgets(rising, 0.01 * lasting_s, now)
    assert slow._forgets(rising, 0.13 * lasting_s, now)


def test_a_slow_push_that_the_disturbance_took_up_is_told_with_its_axis_and_course(quiet: Case) -> None:
    size = 2.0 * float(quiet.vehicle.disturbance[5])

    def apply(site: Site, _: np.random.Generator) -> None:
        site.push[:, 5] += pushed(site.time_s, size)

    now = fitted(replace(quiet, planted=(Planted("push", {}, apply, 1.0, novel=True),)))
    assert [*slow_axes(now)] == [5]
    (found,) = slow_forces(now)
    true = pushed(now.course.time_s, size)
    assert found.gain > 2 * UNKNOWN_NATS
    assert np.corrcoef(found.force, true)[0, 1] > 0.8
    assert np.std(found.force) == pytest.approx(np.std(true), rel=0.3)
    left = unexplained_of(weighing_of(now, ()), weighing_of(now, ()).fitted(()))
    told = [(shape.dof, shape.timing) for shape in left.shapes]
    assert (5, "drifting") in told
