"""The nats that a further cause must save: chance, and the remainder of the forms of earlier causes."""

import math

from identify.diagnose.causes.candidates import Cause
from identify.diagnose.causes.form_remainder import FormRemainder
from identify.diagnose.causes.weighing import Fitted
from identify.effects.effect import Effect

LEAST_GAIN, LEAST_SIGMA = 7.0, 1.0
"""Nats on held-out pieces, and standard errors of them, that a further cause must save among some forty candidates."""

LEAST_TIMED_GAIN = 20.0
"""Nats that a sea, or a cause that begins within the dive, must save: its periods or its time were read off the whole
dive, held-out pieces included."""

LEAST_SHARE = 0.01
"""Share of the nats saved by earlier causes, in the axes and pieces they share, that a further cause must exceed.

If the savings of the earlier causes' other forms are smaller, these are the limit. No form of a library is exact, and
a form's remainder grows with its evidence. A cause whose other forms save little is nearly exact.
"""

SHADOW, SHADOW_BEHIND_FILTER = 1e-3, 7e-3
"""Share of the nats saved by earlier causes that a further cause must exceed wherever it acts.

Forms right to a thirtieth of their force leave that much, and their other forms do not absorb it. Behind an
autopilot's filter, whose lateness and smoothing are fitted, they are right to a twelfth, and leave more where they act.
"""

BEGINNING_NATS = 5.0
"""Nats by which causes that begin within the dive must be worth more, and as many more if they end there: the logarithm
of the times in a dive that can be told apart, some 150."""

NEXT_TO_NONE = 0.5
"""Nats of a form's remainder below which no bound is sharpened: half the chance gain of one parameter."""

AMBIGUOUS_NATS = 3.0
"""Held-out nats within which two causes are ambiguous: odds of twenty to one."""

SAME_FORM = 1e-3
"""Share of a cause's nats that may come from its form alone. At tens of thousands of nats no form is exact enough for a
smaller margin to exclude a nearly equal cause."""


def required_gain(remainder: FormRemainder, cause: Cause) -> float:
    """Nats that a further cause must save: chance, plus the form remainder of earlier causes."""
    return least_gain(cause) + remainder_nats(remainder, cause)


def remainder_nats(remainder: FormRemainder, cause: Cause) -> float:
    """Nats that a further cause may save by the form remainder of earlier causes alone."""
    if cause.effect.witnessed or not remainder.fit.causes:
        return 0.0
    shadow = shadow_nats(remainder, cause)
    share = LEAST_SHARE * min(remainder.overlap(cause), remainder.fit.motion_nats)
    return max(shadow, min(share, remainder.saved_overlap(cause)) if share > NEXT_TO_NONE else share)


def shadow_nats(remainder: FormRemainder, cause: Cause) -> float:
    """Nats that a further cause may save by the form remainder of earlier causes, whatever it shares with them; of what
    an autopilot's filter adds, no more than all that they save where it acts.

    Those of steady pushes count where it acts in the same degrees of freedom: the filters are fitted with trims, and a
    push without them saves far more than the dive tells of it.
    """
    fit = remainder.fit
    if cause.effect.witnessed or not fit.causes:
        return 0.0
    steady, overlap = fit.motion_nats - fit.unsteady_nats, remainder.overlap(cause)
    saved = max(fit.unsteady_nats + min(steady, overlap), 0.0)
    behind_filter = min(SHADOW_BEHIND_FILTER * saved, overlap) if remainder.weighing.now.filtered else 0.0
    return max(SHADOW * saved, behind_filter)


def least_gain(cause: Cause) -> float:
    among = math.log(cause.effect.one_of)
    if cause.effect.sea or cause.effect.since_s:
        return LEAST_TIMED_GAIN + (BEGINNING_NATS if cause.effect.has_ended else 0.0) + among
    return LEAST_GAIN + among


def sought_nats(effect: Effect) -> float:
    """Nats by which an effect must be worth more because its form or thruster was sought among several, and its
    beginning, and its end, in all of the dive, in what is held out too."""
    return BEGINNING_NATS * (bool(effect.since_s) + effect.has_ended) + math.log(effect.one_of)


def nats_apart(fit: Fitted, others: Fitted) -> float:
    """Nats within which another cause is as good as the last cause of `fit`."""
    return max(AMBIGUOUS_NATS, SAME_FORM * (fit.gain - others.gain))
