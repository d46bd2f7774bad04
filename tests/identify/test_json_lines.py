"""Logs of JSON lines: an object a line, of one kind or of several."""

import json

import numpy as np
import pytest

from bridge.errors import LogError
from identify.ingest.files.json_lines import read_json_lines
from identify.ingest.open import read_dive

TIMES = np.arange(0.0, 20.0, 0.1)


def written(path, objects, end="\n"):
    path.write_text("\n".join(map(json.dumps, objects)) + end)
    return path


def test_objects_of_several_kinds_are_topics_and_make_a_dive_by_a_column_map(tmp_path):
    """As a DVL and a script on board write them into one file, with a clock of dates."""
    objects = []
    for k, time_s in enumerate(TIMES):
        at_s = 1_768_044_131.0 + time_s
        reading = {
            "time": at_s,
            "type": "velocity",
            "v": {"x": 0.1 * k, "y": 0.0, "z": 0.0},
            "transducers": [{"id": 0}],
        }
        objects += [reading, {"time": at_s, "type": "pushes", "forces": [float(k), 1.0], "mode": "manual"}]
    log = written(tmp_path / "dive.jsonl", objects)
    columns = tmp_path / "columns.yaml"
    columns.write_text(
        "time: {column: time, unit: s}\nvelocity: {columns: [velocity.v.x, velocity.v.y, velocity.v.z], unit: m/s}\n"
        "pwm: {columns: [pushes.forces.0, pushes.forces.1], unit: N}\n"
    )
    dive = read_dive(log, columns)
    assert dive.velocity.value[:, 0] == pytest.approx(0.1 * np.arange(200))
    assert dive.velocity.time_s == pytest.approx(TIMES, abs=1e-6)
    assert dive.unix_at_boot_s == 1_768_044_131.0
    (velocity, pushes) = read_json_lines(log).streams
    assert (velocity.name, pushes.name) == ("velocity", "pushes")
    assert pushes.text["mode"] == ("manual",) * 200


def test_what_an_object_lacks_is_an_empty_cell_and_a_cut_line_is_left_out(tmp_path):
    objects = [
        {"t": 0.1 * k, "depth": None if k == 3 else 1.0} | ({"yaw": 0.5} if k % 2 else {}) for k in range(20)
    ]
    recorded = read_json_lines(written(tmp_path / "a.ndjson", objects, '\n{"t": 2.0, "dep'))
    (table,) = recorded.streams
    assert table.name == ""
    assert recorded.empty["depth"].nonzero()[0].tolist() == [3]
    assert recorded.empty["yaw"].tolist() == [k % 2 == 0 for k in range(20)]
    assert recorded.notes == ("The last line is cut off and was left out.",)


def test_lines_that_are_no_objects_are_named_or_refuse_the_file(tmp_path):
    objects = [{"t": 0.1 * k, "u": 1.0} for k in range(5000)]
    assert read_json_lines(written(tmp_path / "a.jsonl", [*objects, 7, *objects])).notes == (
        "Line 5001 is no JSON object and was left out.",
    )
    with pytest.raises(LogError, match="line 2 is no JSON object"):
        read_json_lines(written(tmp_path / "b.jsonl", [{"t": 1.0}, 7, [1, 2], {"t": 10**400}]))
    with pytest.raises(LogError, match="holds no JSON objects"):
        read_json_lines(written(tmp_path / "c.jsonl", []))


def test_numbers_that_a_broker_writes_as_words_are_numbers_and_words_stay_words(tmp_path):
    objects = [{"t": str(0.1 * k), "u": "NaN" if k == 3 else 0.25, "state": f"leg {k}"} for k in range(20)]
    (table,) = read_json_lines(written(tmp_path / "a.jsonl", objects)).streams
    assert table.columns["t"] == pytest.approx(0.1 * np.arange(20))
    assert table.columns["u"] == pytest.approx([0.25] * 3 + [np.nan] + [0.25] * 16, nan_ok=True)
    assert table.text.keys() == {"state"}
