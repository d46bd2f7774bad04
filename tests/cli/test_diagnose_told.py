"""What `diagnose` prints of an answer: where, what the feed-forward gains, what an upload of what was accepted does."""

from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
from rich.console import Console

from identify.diagnose.candidates import Cause
from identify.diagnose.result import Accepted, Diagnosis, Finding, Gain, Gap, Share, Value
from identify.effects.hydrodynamics import DRAG_ASYMMETRY, QUADRATIC_DRAG
from identify.effects.rigid_body import ADDED_PAYLOAD
from tui.answers import tell_diagnosis
from tui.commands.diagnose import _sends

DRAG = Finding(Cause(QUADRATIC_DRAG, QUADRATIC_DRAG.start()), (), {}, 0.95, {}, 50.0, Gain(0.0234, 0.0051))
D_U = {"D_u": Value(10.0, "N s/m", 9.0, 11.0)}


def diagnosis(*found: Finding, **other) -> Diagnosis:
    gap = Gap(2.0, (), (), {}, (Share("yaw", "turning", 1.0),), (), ())
    made = Diagnosis("d", "v", "c", "explained", gap, found, (), None, None, None, None, (), 1.0)
    return replace(made, **other)


def printed(one: Diagnosis) -> str:
    text = StringIO()
    tell_diagnosis(Console(file=text, width=1000), one)
    return text.getvalue()


def test_the_feed_forward_s_gain_is_printed_and_where_the_gap_lies():
    said = printed(diagnosis(DRAG))
    assert "the feed-forward alone would track to 5.1 mm/s instead of 23 mm/s" in said
    assert "Where: 100 % yaw, turning." in said


def test_shares_of_no_gap_are_not_printed():
    assert "Where: " not in printed(diagnosis(verdict="no_gap"))


def test_an_upload_is_promised_to_send_only_what_the_feed_forward_can_make_up_for():
    path = Path("x.param")
    upload = "seatrial params upload x.param sends"
    drag = Accepted({**D_U, "X_uu": Value(10.0, "N s2/m2", 9.0, 11.0)}, (), ())
    assert _sends(path, diagnosis(DRAG, accepted=drag)) == f"{upload} it to the vehicle"
    munk = replace(DRAG, cause=Cause(DRAG_ASYMMETRY, DRAG_ASYMMETRY.start()))
    assert _sends(path, diagnosis(munk, accepted=Accepted(D_U, (), ()))) == (
        f"the feed-forward can make up for none of its causes; {upload} only the masses and dampings that were fitted "
        "beside them"
    )
    nothing = _sends(path, diagnosis(munk, accepted=Accepted({}, (), ())))
    assert nothing == "nothing in it is for the vehicle; export and simulate --accepted take it"
    payload = replace(DRAG, cause=Cause(ADDED_PAYLOAD, np.array([1.0])))
    assert _sends(path, diagnosis(payload, accepted=Accepted(D_U, (), ()))) == f"{upload} it to the vehicle"
