"""The numbers of docs/methods.md are those of the code."""

import math
import re
from pathlib import Path

import pytest

from identify.diagnose import (
    confidence,
    drift,
    evidence,
    regression,
    search,
    shrink,
    unexplained,
    verdict,
)
from identify.estimators import misfit as admitted
from identify.estimators.pinn import network, training
from identify.identification import LARGEST_RELATIVE_STD
from identify.priors import CONFLICT_SIGMA

PAGE = re.sub(
    r"\s+", " ", (Path(__file__).resolve().parents[2] / "docs" / "methods.md").read_text(encoding="utf-8")
)


@pytest.mark.parametrize(
    "words",
    [
        f"at most {100 * LARGEST_RELATIVE_STD:.0f} % of it",
        f"One more than {CONFLICT_SIGMA:.0f} standard errors off",
        f"moves by {100 * training.SETTLED:.0f} % of its standard error",
        rf"$\rho = {1e5 * network.ROUGHNESS:.0f}\cdot10^{{-5}}$ m/s",
        "off by $\\delta$ (`drift.py`)" if drift.HORIZONS_S[1] == shrink.HORIZON_S == 5.0 else "not 5 s",
        f"{1 - shrink.CHANCE:g} to {1 + shrink.CHANCE:g} by chance",
        f"The best {search.WEIGHED} are weighed",
        f"pieces of {regression.PIECE_S:.0f} s in {evidence.FOLDS} folds",
        f"by more than {search.LEAST_GAIN:.0f} nats ({search.LEAST_SEA_GAIN:.0f} for a sea",
        f"by Wald's test at {100 * confidence.LEAST_CONFIDENCE:.0f} %",
        rf"P = {verdict.MOST_PROBABLE}\,\frac{{m}}{{m + {verdict.HALF_NATS:.0f}}}",
        f"Under {100 * verdict.LIKELY:.0f} % a cause",
        f"within {search.AMBIGUOUS_NATS:.0f} nats of each other "
        f"whose columns have a cosine of {confidence.LEAST_LIKENESS:g}",
        f"= {unexplained.UNKNOWN_NATS}$ nats deceive",
        f"more than {100 * verdict.FORM_SHARE:.0f} % of what the causes save",
        f"more than {100 * unexplained.LEAST_FORCE:.0f} % of what the thrusters do",
        f"fitted without it ({shrink.FOLDS} folds)",
    ],
)
def test_what_the_page_says_is_what_the_code_does(words):
    assert words in PAGE


def test_one_dive_in_a_hundred_may_deceive_and_timing_is_doubted_by_half_a_millisecond():
    assert math.log(1200 * 100) == pytest.approx(unexplained.UNKNOWN_NATS, abs=0.01)
    assert admitted.STAMPED_S == 0.5e-3
    assert verdict.TAKEN_UP == 0.25
    assert verdict.LEAST_CLOSED == verdict.MOST_DISTURBED == 1 / 3
    assert search.MOST_CAUSES == 3
