"""MATLAB's own objects in a `.mat`: tables, timetables and timeseries, with and without the library that reads them."""

import warnings

import numpy as np
import pandas as pd
import pytest

from bridge.errors import LogError
from identify.ingest.files import matlab
from identify.ingest.files.matlab import read_matlab

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # it sets an option of pandas that is no more needed
    from matio import save_to_mat
    from matio.utils.matclass import MatlabOpaque

TIME_S = np.arange(6.0)
VERSIONS = pytest.mark.parametrize("version", ["v7", "v7.3"])


def saved(folder, version, **held):
    path = folder / "made.mat"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of spans of time, which it writes in s
        save_to_mat(str(path), held, version=version)
    return path


def timetable(index):
    index.name = "Time"
    return pd.DataFrame({"u": TIME_S / 8, "r": -TIME_S}, index=index)


def column(values):
    return values[:, None]


def timeseries(time, data, step=0.0):
    """As MATLAB keeps it: evenly spaced times by their start and step alone."""
    info = {
        "Start_": np.array([[2.0]]),
        "Increment_": np.array([[step]]),
        "Length": np.array([[float(len(TIME_S))]]),
    }
    held = {"Data_": data, "Time_": time, "TimeInfo": MatlabOpaque(info, "tsdata.timemetadata")}
    return MatlabOpaque(held, "timeseries")


def by_name(recorded):
    return {stream.name: stream for stream in recorded.streams}


@VERSIONS
def test_a_table_is_a_stream_of_its_columns_beside_the_arrays(tmp_path, version):
    table = pd.DataFrame({"t": TIME_S, "depth": 2 * TIME_S, "mode": list("abcabc")})
    read = by_name(read_matlab(saved(tmp_path, version, log=table, x=column(np.arange(9.0)))))
    assert read["log"].columns["depth"].tolist() == (2 * TIME_S).tolist()
    assert read["log"].text == {"mode": ("a", "b", "c", "a", "b", "c")}
    assert read[""].columns["x"].tolist() == list(range(9))


@VERSIONS
def test_a_timetable_has_the_times_of_its_rows_as_a_column(tmp_path, version):
    spans = pd.TimedeltaIndex((TIME_S / 4 * 1e9).astype("timedelta64[ns]"))
    dates = pd.DatetimeIndex(((1_700_000_000 + TIME_S) * 1e9).astype("datetime64[ns]"))
    path = saved(tmp_path, version, dive=timetable(spans), dated=timetable(dates))
    read = by_name(read_matlab(path))
    assert read["dive"].columns["Time"].tolist() == (TIME_S / 4).tolist()
    assert read["dive"].columns["u"].tolist() == (TIME_S / 8).tolist()
    assert read["dated"].columns["Time"].tolist() == (1_700_000_000 + TIME_S).tolist()


@VERSIONS
def test_timeseries_have_their_times_whether_these_are_kept_or_told_by_their_step(tmp_path, version):
    kept = timeseries(column(TIME_S**2), np.column_stack([TIME_S, -TIME_S]))
    even = timeseries(np.zeros((0, 0)), column(3 * TIME_S), step=0.5)
    upright = timeseries(np.zeros((0, 0)), TIME_S.reshape(1, 1, -1), step=0.25)
    path = saved(tmp_path, version, kept=kept, log={"even": even, "deep": {"upright": upright}})
    read = {name: dict(stream.columns) for name, stream in by_name(read_matlab(path)).items()}
    assert set(read) == {"kept", "log.even", "log.deep.upright"}
    assert {name: values.tolist() for name, values in read["kept"].items()} == {
        "Time": (TIME_S**2).tolist(),
        "Data.0": TIME_S.tolist(),
        "Data.1": (-TIME_S).tolist(),
    }
    assert read["log.even"]["Time"].tolist() == (2 + TIME_S / 2).tolist()
    assert read["log.even"]["Data"].tolist() == (3 * TIME_S).tolist()
    assert read["log.deep.upright"]["Data"].tolist() == TIME_S.tolist()


@VERSIONS
def test_an_object_without_samples_is_left_out_and_named(tmp_path, version):
    path = saved(tmp_path, version, plan=MatlabOpaque({"speed": np.array([[1.0]])}, "Plan"), t=column(TIME_S))
    recorded = read_matlab(path)
    assert set(by_name(recorded)) == {""}
    assert recorded.notes == ("Not read, as they are no arrays of numbers over time: plan.",)


@VERSIONS
def test_without_the_library_objects_are_left_out_with_two_ways_to_have_them_read(
    tmp_path, version, monkeypatch
):
    monkeypatch.setattr(matlab, "can_read_objects", lambda: False)
    table = pd.DataFrame({"t": TIME_S})
    with pytest.raises(LogError) as refused:
        read_matlab(saved(tmp_path, version, log=table))
    for way in ("pip install 'seatrial[matlab]'", "table2struct(T, 'ToScalar', true)"):
        assert way in str(refused.value)
    recorded = read_matlab(saved(tmp_path, version, log=table, x=column(TIME_S)))
    assert set(by_name(recorded)) == {""}
    assert "Not read: objects of MATLAB" in recorded.notes[-1]
    assert "pip install 'seatrial[matlab]'" in recorded.notes[-1]


def test_an_object_that_the_library_can_not_read_is_refused_with_what_to_save(tmp_path, monkeypatch):
    def fail(_path):
        raise RuntimeError("unknown form")

    monkeypatch.setattr(matlab, "read_objects", fail)
    with pytest.raises(LogError, match="holds objects of MATLAB that can't be read; save them as structs"):
        read_matlab(saved(tmp_path, "v7", log=pd.DataFrame({"t": TIME_S})))


def test_the_library_is_looked_for_where_it_is_installed():
    assert matlab.can_read_objects()
