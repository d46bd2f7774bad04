"""Which of several causes that do nearly as well is taken, and which stays beside the others."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest

from identify.diagnose import search
from identify.diagnose.candidates import Cause
from identify.diagnose.search import SIMPLER_SHARE
from identify.diagnose.weighing import Fitted
from identify.effects.effect import Effect
from identify.effects.environment import STEADY_CURRENT
from identify.effects.hydrodynamics import MUNK_MOMENT, MUNK_MOMENT_IN_YAW, QUADRATIC_DRAG
from identify.effects.rigid_body import NET_BUOYANCY, THRUST_BIAS


def fit_of(gain: float, *effects: Effect) -> Fitted:
    causes = tuple(Cause(effect, effect.start()) for effect in effects)
    return Fitted(causes, (), np.zeros(0), np.zeros((0, 0)), np.zeros((0, 0)), 0.0, gain, 1.0, gain)


@dataclass(frozen=True)
class Weighed:
    """Fits by the labels of their causes, whoever asks; no more of a weighing."""

    gains: Mapping[tuple[str, ...], float]
    library: tuple[Effect, ...]

    def fitted(self, causes: Sequence[Cause]) -> Fitted:
        labels = tuple(sorted(cause.effect.label for cause in causes))
        return replace(fit_of(self.gains[labels], *(cause.effect for cause in causes)), causes=tuple(causes))

    def candidates_beside(self, _fit: Fitted) -> None:
        return None

    def candidates_beyond_forms(self, _fit: Fitted) -> None:
        return None


@pytest.mark.parametrize(("share", "taken"), [(0.9, NET_BUOYANCY), (1.1, THRUST_BIAS)])
def test_a_weight_is_taken_for_a_push_in_any_direction_up_to_half_a_per_cent(
    share: float, taken: Effect
) -> None:
    best, less = 2000.0, share * SIMPLER_SHARE * 2000.0
    fits = [fit_of(best, THRUST_BIAS), fit_of(best - less, NET_BUOYANCY)]
    for some in (fits, fits[::-1]):
        found = search._simplest(some, fit_of(0.0))
        assert found is not None
        assert found.causes[-1].effect is taken


def test_of_causes_of_several_numbers_the_best_is_taken() -> None:
    found = search._simplest([fit_of(2000.0, THRUST_BIAS), fit_of(1999.0, STEADY_CURRENT)], fit_of(0.0))
    assert found is not None
    assert found.causes[-1].effect is THRUST_BIAS
    assert search._simplest([], fit_of(0.0)) is None


def test_what_was_taken_for_being_simpler_is_not_swapped_back() -> None:
    weight, push = fit_of(1995.0, NET_BUOYANCY), fit_of(2000.0, THRUST_BIAS)
    assert search._replaces(weight, push, push.causes[0], fit_of(0.0))
    assert not search._replaces(push, weight, weight.causes[0], fit_of(0.0))
    far = fit_of(2020.0, THRUST_BIAS)
    assert search._replaces(far, weight, weight.causes[0], fit_of(0.0))


def test_a_cause_is_judged_beside_the_best_variants_of_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    gains = {
        (): 0.0,
        (QUADRATIC_DRAG.label, MUNK_MOMENT_IN_YAW.label): 60.0,
        (MUNK_MOMENT_IN_YAW.label,): 10.0,
        (MUNK_MOMENT.label,): 50.0,
    }
    weighing = Weighed(
        {tuple(sorted(labels)): gain for labels, gain in gains.items()}, (MUNK_MOMENT, MUNK_MOMENT_IN_YAW)
    )
    tried = [(1.0, 1.0, Cause(effect, effect.start())) for effect in (QUADRATIC_DRAG, MUNK_MOMENT)]
    monkeypatch.setattr(search, "ranked_candidates", lambda *_: tried)
    fit = fit_of(60.0, QUADRATIC_DRAG, MUNK_MOMENT_IN_YAW)
    others = search._others_at_their_best(weighing, fit, 0)  # type: ignore[arg-type]
    assert [cause.effect for cause in others.causes] == [MUNK_MOMENT]


def test_a_drag_that_lacked_a_number_gets_it_back(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside an unknown current the drag of surge does not show; beside the current it does."""
    alone, whole = (
        Cause(QUADRATIC_DRAG, np.array(values))
        for values in ([0.0, 12.0, 0, 0, 0, 1.0], [18.0, 22.0, 0, 0, 0, 1.3])
    )
    weighing = Weighed({(): 0.0, (QUADRATIC_DRAG.label,): 50.0}, (QUADRATIC_DRAG,))
    fit = replace(fit_of(30.0, QUADRATIC_DRAG), causes=(alone,))
    for tried, expected in (((whole, alone), whole), ((alone,), alone)):
        ranked = [(1.0, 1.0, cause) for cause in tried]
        monkeypatch.setattr(search, "ranked_candidates", lambda *_, ranked=ranked: ranked)
        monkeypatch.setattr(search, "_shows_in_motion", lambda *_: True)
        found = search.swapped(weighing, fit)  # type: ignore[arg-type]
        assert found.causes == (expected,)
