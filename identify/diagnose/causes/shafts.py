"""Whether a thruster lags in its shaft's speed or in its thrust, by which of the two explains a dive better.

Thrust goes with the square of the speed: a shaft that lags makes a thrust that starts gently and reverses late. Under
a lag of the thrust that difference would pass for a dead zone, or for a curve that falls short at its low end.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from bridge.arrays import Array
from identify.diagnose.causes.confidence import without_doubtful
from identify.diagnose.causes.requirement import AMBIGUOUS_NATS, LEAST_GAIN
from identify.diagnose.causes.search import Explanation, explain
from identify.diagnose.filters.nominal import Nominal, refitted
from identify.effects.actuators import shaft_lag
from identify.effects.effect import QUICK_COMMANDS, Effect, before_the_shaft
from identify.threads import both

UNKNOWN_BETWEEN = 0.1
"""Share of a search's nats by which the form of a lag is uncertain where the commands between two messages are unknown:
taken for straight lines, they leave more than the forms differ by."""


@dataclass(frozen=True)
class Search:
    """The causes of a dive's gap, with the covariance (k, k) of their parameters, and the nominal model without
    them. beginnings: the effects tried that begin within the dive."""

    nominal: Nominal
    explanation: Explanation
    covariance: Array
    beginnings: tuple[Effect, ...] = ()

    @property
    def worth(self) -> float:
        """Log posterior of the filters, less the gain that each cause must reach."""
        return self.explanation.now.log_posterior - LEAST_GAIN * len(self.explanation.causes)


def of_likelier_lag(
    nominal: Nominal,
    library: Sequence[Effect],
    uncertain_share: float,
    progress: Callable[[float, str], None],
) -> Search:
    """The causes with a lag of the thrust, or with a lag of the shafts' speed if that explains the dive better.

    A lag of the shafts makes the thrust later, as many a cause does, so both are searched if the nominal fit prefers
    it. It must do better by `uncertain_share` of the nats that its causes gain.
    """
    by_shaft = of_shafts(nominal) if _can_tell(nominal, library) else nominal
    if by_shaft.log_posterior < nominal.log_posterior + LEAST_GAIN:
        return _searched(nominal, library, progress)
    plain, other = both(
        lambda: _searched(nominal, library, progress),
        lambda: _searched(by_shaft, (*library, shaft_lag(nominal.course.lag_s)), lambda _share, _words: None),
    )
    uncertain = uncertain_share * (other.worth - nominal.log_posterior)
    return other if other.worth > plain.worth + max(AMBIGUOUS_NATS, uncertain) else plain


def of_shafts(nominal: Nominal) -> Nominal:
    """The same dive with the nominal lag as that of the shafts' speed."""
    course = replace(nominal.course, by_shaft=True)
    more = before_the_shaft(course, course.thrust_n - nominal.course.thrust_n)
    now = refitted(replace(nominal, course=course), [more])
    seen = tuple(replace(witness, off=witness.left(now.acts)) for witness in nominal.witnesses)
    return replace(now, acts=(), witnesses=seen)


def _can_tell(nominal: Nominal, library: Sequence[Effect]) -> bool:
    """Whether each thruster's command is known at all times, and no lag was accepted."""
    return (
        nominal.course.lag_s > 0.0
        and not nominal.course.by_wrench
        and any(QUICK_COMMANDS in effect.needs for effect in library)
        and not any(cause.effect.timing for cause in nominal.accepted)
    )


def _searched(nominal: Nominal, library: Sequence[Effect], progress: Callable[[float, str], None]) -> Search:
    explanation = explain(nominal, library, progress)
    return Search(nominal, *without_doubtful(explanation, nominal, library))
