"""Tables of text: their forms, bad lines, and cells that hold a number with its unit or a word for none."""

import gzip

import numpy as np
import pytest
from built_recordings import of_table, write
from turning_vehicle import readings, usual

from bridge.errors import LogError
from identify.ingest.files.text_table import read_table
from identify.ingest.mapping.proposal_of_runs import propose

MAP = "time: {column: t}\ndepth: {columns: [z], unit: m}\n"


def text_table(path):
    """The only stream of a table, and its notes."""
    recorded = read_table(path)
    (stream,) = recorded.streams
    return stream, recorded.notes


def written(tmp_path, text, name="dive.csv"):
    """A file with this text, or these bytes."""
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def dive_of(tmp_path, text, columns=MAP):
    return of_table(tmp_path, text, columns)


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("t,z\n0,1.5\n1,2.25\n", "a.csv"),
        ("t;z\n0;1.5\n1;2.25\n", "a.csv"),
        ("t;z\n0;1,5\n1;2,25\n", "a.csv"),
        ("t\tz\n0\t1,5\n1\t2,25\n", "a.tsv"),
        ("t\tz\r\n0\t1.5\r\n1\t2.25\r\n", "a.tsv"),
        ("  t     z\n  0   1.5\n  1  2.25\n", "a.txt"),
        ("\ufefft,z\n0,1.5\n1,2.25\n", "a.csv"),
        ("# a tank\n% of ours\n\nt,z\n0,1.5\n# lunch\n1,2.25\n", "a.csv"),
        ("# a tank\n# t z\n0 1.5\n1 2.25\n", "a.txt"),
        ("%t,z\n0,1.5\n1,2.25\n", "a.csv"),
        ("# t z\n0,00 1,50\n1,00 2,25\n", "a.txt"),
        ("# t, z\n0, 1.5\n1, 2.25\n", "a.txt"),
        ('"t","z"\n"0","1.5"\n"1","2.25"\n', "a.csv"),
        ("t,z\n0,1.5,\n1,2.25,\n", "a.csv"),
        ("t,z\r0,1.5\r1,2.25\r", "a.csv"),
    ],
)
def test_every_usual_form_gives_the_same_numbers(tmp_path, text, name):
    stream, _ = text_table(written(tmp_path, text, name))
    assert stream.name == ""
    assert stream.columns["t"].tolist() == [0.0, 1.0]
    assert stream.columns["z"].tolist() == [1.5, 2.25]
    assert stream.text == {}


@pytest.mark.parametrize("separator", [";", "\t"])
def test_numbers_with_decimal_commas_may_begin_with_whole_ones_as_of_a_vehicle_at_rest(tmp_path, separator):
    rows = ["t;z", *(f"{k};0" for k in range(50)), *(f"{50 + k};{k},5" for k in range(50))]
    stream, _ = text_table(written(tmp_path, "\n".join(rows).replace(";", separator)))
    assert stream.columns["t"].tolist() == list(range(100))
    assert stream.columns["z"].tolist() == [0.0] * 50 + [k + 0.5 for k in range(50)]


def test_a_table_in_gzip_and_one_in_the_wide_text_of_a_spreadsheet_are_read(tmp_path):
    plain = "t,z\n0,1.5\n"
    for data in (gzip.compress(plain.encode()), plain.encode("utf-16")):
        stream, notes = text_table(written(tmp_path, data, "a.csv.gz"))
        assert stream.columns["z"].tolist() == [1.5]
        assert notes == ()


def test_a_degree_sign_in_the_old_code_of_a_spreadsheet_is_kept(tmp_path):
    stream, _ = text_table(written(tmp_path, "t;heading [°]\n0;90,5\n".encode("cp1252")))
    assert stream.columns["heading [°]"].tolist() == [90.5]


@pytest.mark.parametrize(
    "text",
    ["t [s],u [m/s]\n0,1\n", "t [s]  u [m/s]\n0  1\n", "t,u\ns,m/s\n0,1\n", "t;u\n[s];(m/s)\n0;1\n"],
)
def test_units_stay_in_the_names_or_join_them_from_a_line_of_their_own(tmp_path, text):
    stream, _ = text_table(written(tmp_path, text))
    assert list(stream.columns) == ["t [s]", "u [m/s]"]
    assert stream.columns["u [m/s]"].tolist() == [1.0]


def test_a_table_without_names_is_named_by_numbers_and_says_so(tmp_path):
    stream, notes = text_table(written(tmp_path, "0 1.5\n1 2.25\n"))
    assert list(stream.columns) == ["1", "2"]
    assert notes == ("The table has no line of names: its columns are named by their numbers, 1 to 2.",)


def test_names_that_are_missing_or_stand_twice_are_told_apart(tmp_path):
    stream, notes = text_table(written(tmp_path, ",z,z\n0,1,2\n"))
    assert notes == ("Several columns are named z: the first keeps that name.",)
    assert {name: column.tolist() for name, column in stream.columns.items()} == {
        "column 1": [0.0],
        "z": [1.0],
        "z (column 3)": [2.0],
    }


def test_a_column_of_words_is_kept_as_words_and_refuses_no_file_that_does_not_use_it(tmp_path):
    text = 't,state,z\n0,"idle, dry",1\n1,armed,2\n'
    stream, _ = text_table(written(tmp_path, text))
    assert stream.text == {"state": ("idle, dry", "armed")}
    assert dive_of(tmp_path, text).depth.value[:, 0].tolist() == [1.0, 2.0]
    with pytest.raises(LogError, match="row 2 holds 'idle, dry', which is no number"):
        dive_of(tmp_path, text, MAP.replace("[z]", "[state]"))


def test_true_and_false_are_numbers_and_missing_words_are_unknown(tmp_path):
    stream, _ = text_table(written(tmp_path, "t,on,z\n0,True,N/A\n1,FALSE,null\n2,true,3\n"))
    assert stream.columns["on"].tolist() == [1.0, 0.0, 1.0]
    assert np.isnan(stream.columns["z"][:2]).all()
    assert stream.columns["z"][2] == 3.0


@pytest.mark.parametrize("said", ["1.#QNAN", "-1.#IND00", "nan(ind)", "-nan(ind)", "#DIV/0!"])
def test_what_programs_of_windows_write_for_no_number_is_unknown_and_makes_no_words_of_a_column(
    tmp_path, said
):
    stream, notes = text_table(written(tmp_path, f"t,u\n0,{said}\n1,0.5\n2,{said}\n"))
    assert np.isnan(stream.columns["u"]).tolist() == [True, False, True]
    assert notes == ()


def test_a_column_of_numbers_with_too_many_words_among_them_is_told(tmp_path):
    rows = "".join(f"{k},{'lost' if k % 10 == 3 else 0.1 * k},dry\n" for k in range(100))
    stream, notes = text_table(written(tmp_path, f"t,u,state\n{rows}"))
    assert stream.text.keys() == {"u", "state"}
    assert notes == (
        "90 cells of 'u' are numbers, and row 5 holds 'lost', which is no number: the column was read as words.",
    )


def test_an_empty_cell_is_told_from_one_that_is_no_number(tmp_path):
    table = read_table(written(tmp_path, "t,z\n0,\n1,nan\n2,5\n"))
    assert np.isnan(table.streams[0].columns["z"][:2]).all()
    assert table.empty["z"].tolist() == [True, False, False]
    assert "t" not in table.empty


@pytest.mark.parametrize(
    ("bad", "said"),
    [
        ("7,1,2", "Row 702 has 3 cells, the first line names 2: it was left out."),
        ("7,x1", "Row 702 holds 'x1', which is no number: it was left out."),
    ],
)
def test_a_bad_line_in_a_thousand_is_left_out_with_its_number(tmp_path, bad, said):
    lines = [f"{k},1" for k in range(2000)]
    lines[700] = bad
    table = read_table(written(tmp_path, "t,z\n" + "\n".join(lines) + "\n"))
    assert table.notes == (said,)
    assert len(table.streams[0].columns["t"]) == 1999
    assert 700.0 not in table.streams[0].columns["t"]
    assert table.lines[699:701].tolist() == [701, 703]


def test_more_bad_lines_than_one_in_a_thousand_refuse_the_file_with_the_first(tmp_path):
    lines = [f"{k},1" for k in range(2000)]
    for place in (900, 700, 800):
        lines[place] = "1,2,3"
    with pytest.raises(
        LogError, match="row 702 has 3 cells, the first line names 2; and 2 more rows are bad"
    ):
        text_table(written(tmp_path, "t,z\n" + "\n".join(lines) + "\n"))


def test_a_word_that_stands_rarely_in_an_empty_column_costs_no_row(tmp_path):
    lines = [f"{k},{'mark' if k == 500 else ''}" for k in range(3000)]
    stream, notes = text_table(written(tmp_path, "t,event\n" + "\n".join(lines) + "\n"))
    assert len(stream.columns["t"]) == 3000
    assert stream.text["event"][500] == "mark"
    assert notes == ()


@pytest.mark.parametrize("at", [0, 1500, 2999])
def test_a_row_with_an_impossible_time_is_left_out_and_named(tmp_path, at):
    lines = [f"{1e30 if k == at else k},{k / 2}" for k in range(3000)]
    dive = dive_of(tmp_path, "t,z\n" + "\n".join(lines) + "\n")
    assert dive.depth.value[:, 0].tolist() == [k / 2 for k in range(3000) if k != at]
    assert [note for note in dive.notes if f"first row {at + 2}, 1e+30 s: 1 row was left out" in note]
    assert not any("of its own" in note for note in dive.notes)


def test_zero_bytes_after_a_loss_of_power_cost_the_row_in_which_they_stand(tmp_path):
    lines = [f"{k},{k / 2}" for k in range(3000)]
    stream, notes = text_table(written(tmp_path, "t,z\n" + "\n".join(lines) + "\n" + 500 * "\0"))
    assert stream.columns["t"].tolist() == list(range(3000))
    assert notes == ("The last row is cut off and was left out.",)
    lines[1500] = "1500,\0\0"
    stream, notes = text_table(written(tmp_path, "t,z\n" + "\n".join(lines) + "\n"))
    assert stream.columns["z"].tolist() == [k / 2 for k in range(3000) if k != 1500]
    assert notes == ("Row 1502 holds '??', which is no number: it was left out.",)


def test_a_zero_byte_that_a_serial_line_garbled_near_the_beginning_refuses_no_table(tmp_path):
    lines = ["1,AB,0.1", '2,"C\0",0.2', *(f"{k},BI,{k / 10}" for k in range(3, 200))]
    stream, notes = text_table(written(tmp_path, "t,kind,z\n" + "\n".join(lines) + "\n"))
    assert stream.columns["z"] == pytest.approx(np.arange(1, 200) / 10)
    assert stream.text["kind"][:3] == ("AB", "C\0", "BI")
    assert notes == ()


def test_bytes_are_no_table(tmp_path):
    with pytest.raises(LogError, match="is no table of text"):
        text_table(written(tmp_path, bytes(range(256))))


def test_numbers_over_many_parts_of_a_long_table_are_exact(tmp_path):
    value = np.round(np.random.default_rng(0).normal(size=120_000), 6)
    rows = [f"{k},{v}" for k, v in enumerate(value.tolist())]
    rows[70_000] = "70000,"
    stream, notes = text_table(written(tmp_path, "t,z\n" + "\n".join(rows) + "\n"))
    known = np.arange(len(value)) != 70_000
    assert np.array_equal(stream.columns["t"], np.arange(len(value)))
    assert np.array_equal(stream.columns["z"][known], value[known])
    assert np.isnan(stream.columns["z"][70_000])
    assert notes == ()


def test_a_separator_within_quotes_shifts_no_column_in_any_part_of_a_long_table(tmp_path):
    rows = [f'{k},"a,5,7",{k}.5' for k in range(60_000)]
    stream, _ = text_table(written(tmp_path, "t,what,z\n" + "\n".join(rows) + "\n"))
    assert np.array_equal(stream.columns["z"], stream.columns["t"] + 0.5)
    assert set(stream.text["what"]) == {"a,5,7"}


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
