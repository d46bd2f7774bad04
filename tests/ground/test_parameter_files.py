"""Parameter files: the forms that are read, lines that are refused, values that survive the round trip."""

import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.errors import ParamRejected
from gcs_plugin.params import float32
from gcs_plugin.params.files import (
    check_system,
    parse,
    read_parameters,
    system_of,
    text_of,
    write_parameters,
)

SINGLES = st.floats(width=32, allow_nan=False, allow_infinity=False)
NAMES = st.from_regex(r"[A-Z_][A-Z0-9_]{0,15}", fullmatch=True)
SETS = st.dictionaries(NAMES, SINGLES, min_size=1, max_size=20)


@given(SETS)
@settings(max_examples=60)
@pytest.mark.parametrize("suffix", [".param", ".parm", ".params"])
def test_every_float32_survives_each_form(suffix, values):
    back = {entry.name: entry.value for entry in parse(text_of(values, suffix), "x")}
    assert {name: float32.bits(value) for name, value in back.items()} == {
        name: float32.bits(value) for name, value in values.items()
    }


@given(SINGLES)
@settings(max_examples=200)
def test_the_text_of_a_value_is_no_longer_than_nine_digits_need(value):
    assert float32.same(float(float32.text(value)), value)
    assert len(float32.text(value)) <= len(f"{value:.9g}") + 2


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.7, "0.7"),
        (1234.567, "1234.567"),
        (24.4, "24.4"),
        (3.2e-7, "3.2e-07"),
        (1.0, "1"),
        (16777216.0, "16777216"),
    ],
)
def test_values_are_written_as_a_person_would(value, text):
    assert float32.text(value) == text


def test_all_the_forms_that_others_write_are_read(tmp_path):
    path = tmp_path / "mixed.param"
    path.write_text(
        "\ufeff# a comment\r\nFF0_M_U,24.4\r\nFF0_D_U 42.13  # surge\n\nFF0_I_R\t1.5e1\n"
        "1\t1\tVISO_POS_Y\t-0.200000002980232239\t9\nA_NAME_OF_16_CHR,-0e5\n"
    )
    assert read_parameters(path) == {
        "FF0_M_U": float32.rounded(24.4),
        "FF0_D_U": float32.rounded(42.13),
        "FF0_I_R": 15.0,
        "VISO_POS_Y": float32.rounded(-0.2),
        "A_NAME_OF_16_CHR": 0.0,
    }


def test_a_dump_of_two_components_is_refused_where_both_have_a_name(tmp_path):
    path = tmp_path / "both.params"
    path.write_text("1\t1\tFF_MODE\t1\t9\n1\t191\tFF_MODE\t3\t9\n")
    with pytest.raises(ParamRejected, match="FF_MODE is given twice, on lines 1 and 2"):
        read_parameters(path)


def test_a_file_says_of_which_vehicle_it_was_saved_where_its_form_does(tmp_path):
    path = tmp_path / "saved.params"
    path.write_text("7\t191\tFF0_M_U\t9\t9\n7\t191\tFF0_D_U\t9\t9\n")
    assert system_of(path) == 7
    check_system(path, 7, 7, "")
    with pytest.raises(ParamRejected, match="saved from vehicle 7, this is vehicle 1; nothing was sent"):
        check_system(path, system_of(path), 1, "")
    write_parameters(tmp_path / "saved.param", {"FF0_M_U": 9.0}, system=7)
    assert system_of(tmp_path / "saved.param") == 7
    path.write_text("FF0_M_U,9\n")
    assert system_of(path) is None
    check_system(path, system_of(path), 1, "")
    path.write_text("7\t191\tFF0_M_U\t9\t9\n1\t191\tFF0_D_U\t9\t9\n")
    with pytest.raises(ParamRejected, match=r"several vehicles \(1, 7\)"):
        system_of(path)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("FF0_D_U,nan", "FF0_D_U is nan, not a finite number"),
        ("FF0_D_U -INF", "FF0_D_U is -INF, not a finite number"),
        ("FF0_D_U,1e39", "does not fit a float32"),
        ("FF0_D_U,1_000", "'1_000' for a number"),
        ("FF0_D_U,0x10", "'0x10' for a number"),
        ("FF0_D_U,\u0662\u0664", "for a number"),
        ("FF0_D_U", "not a name and a value"),
        *((line, "not a name and a value") for line in ("A 1 2", "1 1 A 1", "1 1 A 1 9 9")),
        *((line, "not a name and a value") for line in ("x 1 A 1 9", "1 x A 1 9", "1 1 A 1 x")),
        ("0FF,1", "no parameter name"),
        ("A_NAME_OF_17_CHRS,1", "longer than 16"),
        ("\x1b[31mRED,1", "no parameter name"),
    ],
)
def test_a_bad_second_line_is_refused_by_its_number(tmp_path, line, words):
    path = tmp_path / "bad.param"
    path.write_text(f"FF0_M_U,24.4\n{line}\n")
    with pytest.raises(ParamRejected) as error:
        read_parameters(path)
    assert "line 2" in str(error.value)
    assert words in str(error.value)
    assert "\x1b" not in str(error.value)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "no such file"),
        (b"# nothing\n", "holds no parameters"),
        (b"\xff\xfe\x00\x01", "is no text; give"),
        (b"A 1\n" * 1_100_000, "too long"),
    ],
    ids=["absent", "empty", "binary", "vast"],
)
def test_what_is_no_parameter_file_is_said_in_a_sentence(tmp_path, content, words):
    if content is not None:
        (tmp_path / "a.param").write_bytes(content)
    with pytest.raises(ParamRejected, match=words):
        read_parameters(tmp_path / "a.param")
    with pytest.raises(ParamRejected, match="is a folder; give"):
        read_parameters(tmp_path)


def test_a_file_written_is_read_back_the_same(tmp_path):
    values = {"FF0_M_U": float32.rounded(24.4), "FF0_D_U": float32.rounded(3.2e-7)}
    path = tmp_path / "made" / "set.parm"
    write_parameters(path, values, ["two\nlines"])
    assert read_parameters(path) == values


def test_a_value_that_is_not_finite_or_another_suffix_leaves_the_old_file_as_it_was(tmp_path):
    path = tmp_path / "set.param"
    write_parameters(path, {"A": 1.0})
    with pytest.raises(ParamRejected, match="not written, A: nan is not a finite number; mend the value"):
        write_parameters(path, {"A": float("nan")})
    with pytest.raises(ParamRejected, match=r"ends in \.param"):
        write_parameters(tmp_path / "set.txt", {"A": 1.0})
    assert read_parameters(path) == {"A": 1.0}
    assert list(tmp_path.iterdir()) == [path]


def test_rounding_is_that_of_the_wire():
    assert float32.rounded(0.7) == struct.unpack("<f", struct.pack("<f", 0.7))[0]
    assert not float32.same(0.7, 0.7 + 1e-6)
    assert float32.same(1234.567, 1234.567 + 1e-6)
    assert float32.rounded(1e-46) == 0.0


@pytest.mark.parametrize("value", [1e-46, -1e-46, 5e-324])
def test_what_would_be_zero_on_the_wire_is_given_by_nobody(value):
    with pytest.raises(ValueError, match="is too small for a float32, which would hold 0"):
        float32.from_user(value)
    assert (float32.from_user(0.0), float32.from_user(-0.0)) == (0.0, 0.0)
    assert float32.from_user(1e-45) == float(np.finfo(np.float32).smallest_subnormal)


@pytest.mark.parametrize("hidden", ["\x0c", "\x0b", "\x85", "\u2028", "\x1e"])
def test_nothing_that_a_reader_takes_for_a_comment_is_a_parameter(hidden):
    result = parse(f"FF0_M_U,24 # as before {hidden}FF_MODE,3\r\nFF0_D_U,5\rFF0_M_V,6\n", "x")
    assert [entry.name for entry in result] == ["FF0_M_U", "FF0_D_U", "FF0_M_V"]


@pytest.mark.parametrize("thing", ["a file", "a link to nothing"])
def test_a_place_whose_folder_is_none_is_named(tmp_path, thing):
    place = tmp_path / "receipts"
    place.touch() if thing == "a file" else place.symlink_to(tmp_path / "nothing")
    with pytest.raises(ParamRejected) as refused:
        write_parameters(place / "a.param", {"FF1_M_U": 1.0})
    assert str(refused.value) == f"{place / 'a.param'}: {place} is no folder; choose another place"
