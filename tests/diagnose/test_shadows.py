"""A cause that stands in for what the form of a better told one leaves is not taken."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray

from identify.challenge.case import Case, dive_of, draw_case
from identify.challenge.nearest import course_of
from identify.challenge.site import Site
from identify.diagnose.candidates import Cause, other_forms, other_variants
from identify.diagnose.recording import fitted_nominal
from identify.diagnose.search import explain, remainder_nats
from identify.effects.environment import waves
from identify.effects.library import library
from identify.effects.rigid_body import CG_OFFSET, CG_OFFSET_IN_SPACE

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Fit:
    motion_nats: float
    causes: tuple[str, ...] = ("another",)


@dataclass(frozen=True)
class Now:
    filtered: tuple[int, ...]


@dataclass(frozen=True)
class Weighed:
    now: Now


@dataclass(frozen=True)
class Apart:
    """A remainder in axes where a further cause does not act."""

    fit: Fit
    weighing: Weighed = Weighed(Now(()))

    def overlap(self, _cause: Cause) -> float:
        return 0.0

    def saved_overlap(self, _cause: Cause) -> float:
        return 0.0


def turned_by_waves(seed: int) -> Case:
    """Waves that also turn the hull, as they do a long one: by the slope of the water, so in step with their push."""
    case = draw_case(seed, kind="one", names=("waves",))
    _, simulated = case.simulated(0)
    (plant,) = case.planted
    w, x, y, z = simulated.ticks.state[:, 3:7].T
    heading = np.unwrap(np.arctan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z)))
    assert simulated.dive.pwm is not None
    at_s = simulated.dive.pwm.time_s

    def apply(site: Site, rng: np.random.Generator) -> None:
        plant.apply(site, rng)
        ahead = np.interp(site.time_s, at_s, heading)
        north, east = site.moving_water()[:, 9:11].T
        heavy = site.rigid[2, 2] + site.added[2, 2]
        site.push[:, 4] += 0.06 * heavy * (north * np.cos(ahead) + east * np.sin(ahead))
        site.push[:, 3] += 0.02 * heavy * (east * np.cos(ahead) - north * np.sin(ahead))

    return replace(case, planted=(replace(plant, apply=apply),))


def test_the_moments_of_moving_water_are_among_its_forms() -> None:
    case = draw_case(391_001, kind="none", seconds=40.0)
    sea = waves(4.0)
    forms = other_forms(course_of(*case.simulated(0)), Cause(sea, sea.start()))
    wrenches = [form.wrench for form in forms if form.wrench is not None]
    assert any(one[:, 3:].any() and not one[:, :3].any() for one in wrenches)


def test_a_further_cause_has_to_save_more_than_a_shadow_of_a_far_better_told_one() -> None:
    offset = Cause(CG_OFFSET, CG_OFFSET.start())
    assert remainder_nats(Apart(Fit(20_000.0)), offset) == 20.0  # type: ignore[arg-type]
    assert remainder_nats(Apart(Fit(20_000.0, ())), offset) == 0.0  # type: ignore[arg-type]


def test_behind_an_autopilots_filter_it_has_to_save_seven_times_as_much() -> None:
    offset, filtered = Cause(CG_OFFSET, CG_OFFSET.start()), Weighed(Now((0, 1, 2)))
    assert remainder_nats(Apart(Fit(20_000.0), filtered), offset) == pytest.approx(140.0)  # type: ignore[arg-type]


def test_the_variants_of_a_cause_with_the_same_parameters_are_its_forms_but_not_other_periods_of_a_sea() -> (
    None
):
    course = course_of(*draw_case(391_001, kind="none", seconds=40.0).simulated(0))
    offset = Cause(CG_OFFSET, CG_OFFSET.start())
    (first, *others) = other_variants(course, offset, (CG_OFFSET, CG_OFFSET_IN_SPACE))
    in_space = CG_OFFSET_IN_SPACE.act(course, offset.values).wrench
    assert first.wrench is not None
    np.testing.assert_array_equal(first.wrench, in_space)
    assert any(one.wrench is not None and one.wrench[:, 4].any() for one in others)
    sea = waves(4.0)
    assert not [*other_variants(course, Cause(sea, sea.start()), (sea, waves(5.0)))]


def test_what_goes_with_the_rate_of_pitch_is_not_taken_beside_waves_that_turn_the_hull() -> None:
    case = turned_by_waves(393_303)
    shape = case.file.vehicle.configurations[case.configuration]
    able = [
        one
        for one in library(shape, case.file.vehicle.thrust_curve.lag_s)
        if one.name in ("waves", "dvl_lever_arm")
    ]
    nominal = fitted_nominal(dive_of(case), case.file, case.configuration)
    found = explain(nominal, able, lambda *_report: None)
    assert [cause.effect.name for cause in found.causes] == ["waves"]
