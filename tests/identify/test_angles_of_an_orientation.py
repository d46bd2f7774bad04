"""Three numbers of an orientation are roll, pitch and yaw; four are a quaternion."""

from pathlib import Path

import pytest
from turning_vehicle import readings, table, usual

from identify.ingest.mapping.proposal_of_runs import propose

READ = readings()
ANGLES = ("roll", "pitch", "yaw")


def proposed(columns):
    return propose(table(columns), Path("log.csv"))


@pytest.mark.parametrize("names", ["orientation.{}", "field.orientation.{}", "attitude_{}"])
def test_three_numbers_of_an_orientation_are_roll_pitch_and_yaw(names):
    columns = {name: value for name, value in usual(READ).items() if name not in ANGLES}
    named = [names.format(axis) for axis in "xyz"]
    columns |= dict(zip(named, READ["euler"].T, strict=True))
    proposal = proposed(columns)
    assert proposal.columns.euler.columns == tuple(named)
    assert proposal.columns.euler.unit == "rad"
    assert proposal.columns.quaternion is None


def test_the_imaginary_part_of_a_quaternion_alone_is_no_angles():
    columns = {name: value for name, value in usual(READ).items() if name not in ANGLES}
    columns |= {f"q{axis}": READ["attitude"][:, k + 1] for k, axis in enumerate("xyz")}
    assert proposed(columns).columns.euler is None


def test_four_numbers_of_an_orientation_are_a_quaternion():
    columns = {name: value for name, value in usual(READ).items() if name not in ANGLES}
    columns |= {f"orientation.{axis}": READ["attitude"][:, k] for k, axis in enumerate("wxyz")}
    proposal = proposed(columns)
    assert proposal.columns.quaternion.columns == tuple(f"orientation.{axis}" for axis in "wxyz")
    assert proposal.columns.euler is None
