"""Tables whose cells hold a number with its unit, or a word for no number."""

import numpy as np
import pytest
from built_recordings import of_table, write
from turning_vehicle import readings, usual

from identify.ingest.files.text_table import read_table
from identify.ingest.mapping.proposal_of_runs import propose


def test_a_number_with_its_unit_is_read_and_its_unit_is_proposed(tmp_path):
    read = usual(readings(20.0))
    units = {
        "t": " s", "u": " mm/s", "v": " mm/s", "w": " mm/s", "yaw": "°", "pitch": "°", "roll": "°", "depth": " ft",
        "T1": "us", "T2": "us", "T3": "us", "T4": "us", "ax": " m/s²", "ay": " m/s²", "az": " m/s²",
    }  # fmt: skip
    size = {" mm/s": 1000.0, "°": np.degrees(1.0), " ft": 1 / 0.3048}
    scaled = {name: cells * size.get(units.get(name, ""), 1.0) for name, cells in read.items()}
    rows = [",".join(read)]
    rows += [
        ",".join(f"{scaled[name][k]:.9g}{units.get(name, '')}" for name in read)
        for k in range(len(read["t"]))
    ]
    path = write(tmp_path / "log.csv", "\n".join(rows).encode())
    proposal = propose(read_table(path).streams, path)
    assert proposal.columns.time.column == "t [s]"
    proposed = {name: columns.unit for name, columns in proposal.columns.signals().items()}
    assert proposed | {"gyro": "", "pressure": ""} == {
        "velocity": "mm/s", "euler": "deg", "depth": "ft", "pwm": "us", "specific_force": "m/s2", "gyro": "",
        "pressure": "",
    }  # fmt: skip
    assert proposal.columns.depth.columns == ("depth [ft]",)
    assert proposal.columns.pwm.columns[0] == "T1 [us]"


def test_a_unit_that_the_name_says_already_is_not_said_twice(tmp_path):
    rows = "\n".join(f"{k / 10},{k} cm,{k} m" for k in range(50))
    path = write(tmp_path / "log.csv", f"t,depth_cm,range (m)\n{rows}\n".encode())
    assert [*read_table(path).streams[0].columns] == ["t", "depth_cm", "range (m)"]


@pytest.mark.parametrize("other", ["950 mm", "0.95"])
def test_cells_in_different_units_are_words_and_the_units_are_told(tmp_path, other):
    rows = "\n".join(f"{k / 10},{f'{k} m' if k != 9 else other},{k}" for k in range(50))
    read = read_table(write(tmp_path / "log.csv", f"t,depth,u\n{rows}\n".encode()))
    assert [*read.streams[0].text] == ["depth"]
    second = "mm" if "mm" in other else "none"
    assert read.notes == (
        f"The cells of 'depth' are in different units (m, {second}): it was read as words.",
    )


def test_words_that_end_as_units_do_are_words(tmp_path):
    rows = "\n".join(f"{k / 10},{k}a,{k % 3}-survey s,2026-07-19 10:15:{k:02d}Z" for k in range(50))
    read = read_table(write(tmp_path / "log.csv", f"t,trial,leg,date\n{rows}\n".encode()))
    assert ([*read.streams[0].text], read.notes) == (["trial", "leg", "date"], ())


def test_dashes_and_n_a_of_ground_stations_and_spreadsheets_are_no_numbers(tmp_path):
    rows = "0,--.--,-,#N/A\n1,1.5,2,3 \n2,-,--,4\n3,5,6,7\n"
    dive = of_table(
        tmp_path, f"t,u,v,w\n{rows}", "time: {column: t}\nvelocity: {columns: [u, v, w], unit: m/s}\n"
    )
    expected = [[np.nan] * 3, [1.5, 2.0, 3.0], [np.nan, np.nan, 4.0], [5.0, 6.0, 7.0]]
    np.testing.assert_array_equal(dive.velocity.value, expected)
