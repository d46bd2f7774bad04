"""The dives as lines, and which of them is meant."""

import math
from pathlib import Path

import pytest
from made_dives import DAMAGED, DECK, DIVES, HOVERING, dive

from tui.app.drawing import width
from tui.app.screens.dives_lines import details, known_to, length, listed, row_under, table, usual, window
from tui.commands.dives import clock_text

DECK_DIVE, HOVERING_DIVE, DAMAGED_DIVE = listed(DIVES)


def said(lines):
    return ["".join(text for text, _ in line) for line in lines]


def test_dives_are_listed_the_newest_first():
    assert [one.name for one in listed(DIVES)] == ["deck", "hovering", "survey"]
    assert listed(None) == ()


def test_the_newest_that_could_identify_anything_is_meant():
    assert usual(listed(DIVES), None) == HOVERING_DIVE.folder
    assert usual(listed([DECK, DAMAGED]), Path("other")) == Path("other")


def test_what_a_dive_could_tell_is_in_percent_or_no_or_unknown():
    assert known_to(0.0068) == ("0.7 %", "strong")
    assert known_to(0.3) == ("30.0 %", "strong")
    assert known_to(0.31) == ("no", "warn")
    assert known_to(math.inf) == ("no", "warn")
    assert known_to(math.nan) == ("--", "quiet")


def test_a_row_has_length_loss_letters_and_what_was_made_of_it():
    lines = said(table(listed(DIVES), 1, HOVERING_DIVE.folder, DECK_DIVE.folder, 80, 10))
    assert lines[1].split() == [
        "●",
        "2026-11-21",
        "04:52",
        "00:00:41",
        "1.2",
        "%",
        "······",
        "······",
        "deck",
    ]
    assert lines[2].startswith("▶◆  2026-11-21 03:52  00:13:27   1.2 %  UVw··R UVWP·R  hovering")
    assert lines[2].endswith("identified")
    assert lines[3].split() == ["2026-11-20", "02:52", "--", "--", "------", "------", "survey"]


@pytest.mark.parametrize(
    ("cells", "name", "ending"),
    [
        (80, "hovering", " hovering    ident. diagn."),
        (80, "validation-shadow", " validation… ident. diagn."),
        (96, "validation-shadow", " validation-shadow   identified, diagnosed"),
        (90, "validation-shadow", " validation-shadow     ident. diagn."),
    ],
)
def test_what_was_made_of_a_dive_never_vanishes_for_its_name(cells, name, ending):
    (row,) = said(
        table(listed([dive(name, worked_on=["identified", "diagnosed"])]), 0, None, None, cells, 2)
    )[1:]
    assert row.endswith(ending)
    assert len(row) == cells


def test_much_loss_stands_out():
    (row,) = table(listed([dive("a", loss=0.06)]), 0, None, None, 80, 2)[1:]
    assert ("   6.0 %"[2:] + "  ", "warn") in row


@pytest.mark.parametrize("cells", [60, 80, 120])
def test_no_row_is_wider_than_its_room(cells):
    long = listed([dive("x" * 200)])
    assert all(width(line) <= cells for line in table(long, 0, None, None, cells, 5))


def test_the_row_at_the_mark_is_always_shown():
    many = listed([dive(f"d{n}", began_unix_s=1e9 - n) for n in range(30)])
    for at in range(30):
        lines = said(table(many, at, None, None, 80, 8))
        assert len(lines) == 8
        assert sum(line.startswith("▶") for line in lines) == 1
        y = next(n for n, line in enumerate(lines) if line.startswith("▶"))
        assert row_under(y, 30, at, 8) == at
    assert window(3, 2, 8) == 0
    assert row_under(0, 30, 0, 8) is None
    assert row_under(5, 3, 0, 8) is None


def test_the_details_tell_axes_notes_and_what_was_made_of_it():
    lines = said(details(HOVERING_DIVE, False, 80))
    assert lines[2].split() == [
        "surge",
        "M_u",
        "0.7",
        "%",
        "D_u",
        "0.7",
        "%",
        "806",
        "s",
        "46.0",
        "N",
        "0.80",
        "m/s",
    ]
    assert lines[6].split() == [
        "pitch",
        "I_q",
        "no",
        "D_q",
        "no",
        "806",
        "s",
        "9.2",
        "N",
        "m",
        "9.2",
        "deg/s",
    ]
    assert "noted: new propellers at the quay" in lines
    assert "noted at 2026-11-21T03:58:12Z tether caught on the ladder" in lines
    assert "identified by likelihood: converged" in lines


def test_the_details_of_one_that_can_t_be_read_say_why_and_show_no_axes():
    lines = said(details(DAMAGED_DIVE, False, 80))
    assert lines[1].startswith(f"can't be read: {DAMAGED['error'][:40]}")
    assert not any("surge" in line for line in lines)


def test_what_could_not_be_judged_says_why():
    unknown = listed([HOVERING | {"excitation": None, "why_not": "no vehicle file is known"}])[0]
    assert "what it could identify is not known: no vehicle file is known" in said(
        details(unknown, False, 80)
    )
    still = listed([DECK | {"why_not": "no thrust"}])[0]
    assert "nothing to identify: no thrust" in said(details(still, False, 80))
    assert "is being recorded: this is what it holds so far" in said(details(still, True, 80))


def test_bytes_that_belong_to_no_message_are_told():
    (spoilt,) = listed([HOVERING | {"stray": "telemetry.tlog: 9 bytes at its end belong to no message"}])
    assert "telemetry.tlog: 9 bytes at its end belong to no message." in said(details(spoilt, False, 80))


def test_a_restart_and_the_run_that_is_used_are_told():
    (restarted,) = listed([HOVERING | {"restarts": "The vehicle restarted 1 time; of 2 runs one is used."}])
    assert "The vehicle restarted 1 time; of 2 runs one is used." in said(details(restarted, False, 80))


def test_a_damaged_dive_yaml_is_told_beside_what_the_dive_could_tell():
    (damaged,) = listed([HOVERING | {"damaged": "dives/a/dive.yaml: line 2: no YAML"}])
    lines = said(details(damaged, False, 80))
    assert "dives/a/dive.yaml: line 2: no YAML" in lines
    assert not any("not known" in line or "nothing to identify" in line for line in lines)


@pytest.mark.parametrize("seconds", [111.4, 111.5, 112.49, 0.4, 3599.6])
def test_a_dive_is_as_long_as_the_verb_says(seconds):
    assert length(seconds).lstrip("0:") == clock_text(seconds).lstrip("0:")


def test_what_was_not_heard_is_told():
    note = "Nothing was heard of the vehicle for 58 s at a stretch, from 0:10 on: `seatrial fetch` brings it."
    (one,) = listed([{**HOVERING, "unheard": note}])
    assert note in " ".join(" ".join(said(details(one, False, 80))).split())


def test_a_dive_that_is_recorded_and_holds_nothing_yet_shows_that_alone():
    (one,) = listed([{**DECK, "underway": "is being recorded, nothing heard yet"}])
    lines = said(details(one, True, 80))
    assert "is being recorded, nothing heard yet" in lines
    assert not [line for line in lines if "so far" in line or "could tell" in line or "can't" in line]
