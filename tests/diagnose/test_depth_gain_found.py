"""A depth sensor's gain is found in a dive in which a DVL tells how the vehicle sinks."""

import pytest

from identify.challenge.case import dive_of, draw_case
from identify.diagnose.diagnose import diagnose


def test_the_gain_of_a_depth_sensor_is_named_with_its_size() -> None:
    case = draw_case(100_011, names=["depth_scale"], size=1.0, seconds=80.0)
    diagnosis = diagnose(dive_of(case), case.file, case.configuration, progress=lambda *_report: None)
    (finding,) = diagnosis.findings
    assert (diagnosis.verdict, finding.name) == ("explained", "depth_scale")
    assert finding.parameters["scale"].value == pytest.approx(case.planted[0].parameters["scale"], rel=0.02)
