"""What a parameter file asks for, with what its sidecar says against it."""

import dataclasses

import pytest

from bridge.errors import ParamRejected
from gcs_plugin.params.comparison import wanted_by
from gcs_plugin.params.files import Sidecar, write_parameters, write_sidecar

SIDECAR = Sidecar("ab", "cd", "hovering", "likelihood", "0.1", {}, "ruvifist", "lake", "converged")


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "set.param"
    write_parameters(path, {"FF1_M_U": 96.5, "FF1_D_U": 42.25}, [])
    return path


def test_a_file_without_a_sidecar_is_values_alone_and_no_whole_model(file):
    wanted = wanted_by(file, "despite-doubts", despite_doubts=False)
    assert wanted.values == {"FF1_M_U": 96.5, "FF1_D_U": 42.25}
    assert (wanted.notes, wanted.whole) == ((), False)


def test_an_identification_says_where_it_is_from_and_what_is_doubted_of_what_it_sends(file):
    doubted = {"D_u": "the dive is too short", "D_r": "yaw was never pushed"}
    write_sidecar(file, dataclasses.replace(SIDECAR, doubted=doubted))
    wanted = wanted_by(file, "despite-doubts", despite_doubts=False)
    assert wanted.whole
    assert wanted.notes == ("from lake of ruvifist, configuration hovering, by likelihood: converged",)
    assert wanted.warnings == ("warning: D_u is doubted: the dive is too short",)


def test_a_dump_of_another_station_says_of_which_vehicle_it_is(tmp_path):
    path = tmp_path / "saved.params"
    write_parameters(path, {"FF1_M_U": 96.5}, [], system=7)
    assert wanted_by(path, "despite-doubts", despite_doubts=False).system == 7
    write_sidecar(path, SIDECAR)
    assert wanted_by(path, "despite-doubts", despite_doubts=False).system == 7


def test_one_that_did_not_converge_is_sent_only_despite_doubts(file):
    write_sidecar(file, dataclasses.replace(SIDECAR, outcome="stopped at a bound"))
    with pytest.raises(ParamRejected, match=r"ended with 'stopped at a bound'.*nothing was sent"):
        wanted_by(file, "despite-doubts", despite_doubts=False)
    assert wanted_by(file, "despite-doubts", despite_doubts=True).values["FF1_M_U"] == 96.5


def test_the_json_of_identify_is_refused_with_what_to_give(tmp_path):
    with pytest.raises(ParamRejected, match=r"give the \.param"):
        wanted_by(tmp_path / "identified.json", "despite-doubts", despite_doubts=False)
