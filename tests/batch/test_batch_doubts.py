"""What a batch reads of the doubts in an identification's file."""

from dataclasses import replace

from identify.batch.rows import doubts_in
from identify.identification import Culprit, Doubt, Outcome

LATE = Doubt(("M_u", "D_u"), "Thrust acts late", "mend the lag.", Outcome.DISAGREES, Culprit.MODEL)
WARNED = Doubt(("M_u",), "No rate of turn was recorded", "record a gyro.")


def written(*doubts):
    return {"doubts": [doubt.to_json() for doubt in doubts]}


def test_doubts_come_back_from_the_file_as_they_were():
    assert doubts_in(written(LATE, WARNED)) == (LATE, WARNED)


def test_a_doubt_about_a_prior_is_about_no_value_of_the_dive():
    assert doubts_in(written(replace(WARNED, culprit=Culprit.PRIOR), LATE)) == (LATE,)


def test_a_file_that_does_not_say_whom_a_doubt_speaks_against_is_read_as_of_its_recording():
    (told,) = written(LATE)["doubts"]
    del told["culprit"]
    assert doubts_in({"doubts": [told]}) == (replace(LATE, culprit=Culprit.RECORDING),)
