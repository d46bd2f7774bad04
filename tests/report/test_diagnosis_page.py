"""The page of a diagnosis: every answer has its place, its unit and its words."""

import math
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from matplotlib.axes import Axes

from bridge.effects.effect import Effect
from bridge.effects.library import library
from bridge.effects.sensors import WRONG_FEEDBACK_LOG
from bridge.vehicle.config import load_vehicle
from identify.diagnose import verdict_words, where_words, words
from identify.diagnose.cause import Cause
from identify.diagnose.diagnosis import (
    Character,
    Dependence,
    Diagnosis,
    Found,
    Gain,
    Gap,
    Next,
    Share,
    Shrink,
    Slice,
    Tried,
    Value,
)
from identify.diagnose.drift import Drift
from identify.diagnose.mirrored import mounted_otherwise
from identify.report.bars import Bar, bars
from identify.report.diagnosis import diagnosis_page, diagnosis_report
from identify.report.heatmap import heatmap
from identify.report.picture import COLUMN_IN, WIDE_IN
from identify.report.plot import Panel, stack

FILE = load_vehicle("ruvifist:hovering")
LIBRARY = library(FILE.vehicle.configurations["hovering"], 0.1)
NAN = math.nan
NOTHING = Shrink(1.02, 1.01, NAN, NAN, NAN)


def effect(name: str, number: int = 0) -> Effect:
    return next(one for one in LIBRARY if one.name == name and one.number == number)


def found(name: str, number: int = 0, **other: object) -> Found:
    one = effect(name, number)
    told = {key: Value(v, unit, 0.9 * v, 1.1 * v) for key, (v, unit) in one.told(one.start()).items()}
    made = Found(Cause(one, one.start()), (), {}, 0.999, told, 60.0)
    return replace(made, **other)  # type: ignore[arg-type]


def drift(horizon_s: float, size: float) -> Drift:
    """Surge, sway and yaw fitted; off by `size` floors, a little more in surge."""
    starts_s = np.arange(100.0, 400.0)
    floor = np.array([0.01, 0.012, NAN, NAN, NAN, 0.005]) * horizon_s**0.5
    wave = np.sqrt(2) * np.sin(2 * np.pi * starts_s / 10)
    off = size * wave[:, None] * floor * np.array([1.0, 0.5, 1, 1, 1, 0.5])
    return Drift(horizon_s, starts_s, off, floor)


def gap(before: float = 3.4, after: float = 1.2) -> Gap:
    where = (
        Share("surge", "steady", 0.71),
        Share("surge", "accelerating", 0.12),
        Share("sway", "turning", 0.15),
        Share("yaw", "rest", 0.02),
    )
    slices = (
        Slice("surge", "speed", 0.0, 0.15, 0.02),
        Slice("surge", "speed", 0.15, 0.3, 0.08),
        Slice("surge", "speed", 0.3, 0.6, 0.73),
        Slice("surge", "heading", 0.0, math.pi, 0.4),
        Slice("surge", "heading", math.pi, 2 * math.pi, 0.43),
        Slice("surge", "voltage", 14.0, 16.8, 0.83),
        Slice("sway", "depth", 2.0, 5.0, 0.15),
        Slice("sway", "depth", 5.0, 7.5, 0.01),
    )
    depends = (Dependence("surge", "speed", "odd", 0.8), Dependence("yaw", "thrust_sign", None, 0.1))
    return Gap(
        before,
        tuple(drift(h, before) for h in (1.0, 5.0, 20.0)),
        tuple(drift(h, after) for h in (1.0, 5.0, 20.0)),
        {"surge": 2.4, "sway": 0.31, "yaw": 0.12},
        where,
        slices,
        depends,
    )


def diagnosis(**other: object) -> Diagnosis:
    tried = [Tried(one.name, one.label, 5.0 - 0.2 * k, False) for k, one in enumerate(LIBRARY)]
    tried[0] = replace(tried[0], gain_nats=61.2, accepted=True)
    drag = found("quadratic_drag", feedforward=Gain(0.0234, 0.0051))
    made = Diagnosis(
        "lap-3",
        "ruvifist",
        "hovering",
        "explained",
        gap(),
        (drag,),
        tuple(tried),
        None,
        Shrink(3.4, 1.25, 0.896, 0.84, 0.94),
        Shrink(3.1, 1.3, 0.857, 0.79, 0.92),
        None,
        ("The battery's voltage was not recorded.",),
        4.2,
    )
    return replace(made, **other)  # type: ignore[arg-type]


class Text(HTMLParser):
    """What a reader sees, a line an element, and the attributes of every element."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.lines: list[str] = []
        self.attributes: list[tuple[str, dict[str, str | None]]] = []
        self.narrow = False
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.attributes.append((tag, dict(attrs)))
        # What a telephone is shown says the same once more.
        if tag == "svg":
            self.narrow = dict(attrs)["class"] == "column-picture"

    def handle_endtag(self, tag: str) -> None:
        self.narrow = self.narrow and tag != "svg"

    def handle_data(self, data: str) -> None:
        if data.strip() and not self.narrow:
            self.lines.append(data.strip())


def read(one: Diagnosis) -> str:
    return "\n".join(Text(diagnosis_page(one)).lines)


UNKNOWN = Character(("yaw",), "world", "even", "intermittent", ("heading", "yaw_rate"))


def test_the_verdict_says_cause_place_speed_and_what_the_drift_falls_to():
    said = verdict_words.verdict_sentence(diagnosis(check=None, heldout=None))
    assert said == (
        "Quadratic drag explains the gap: 71 % of it is in surge, steady, mostly above 0.30 m/s; "
        "with it the model's 5 s drift falls from 3.4 to 0.85 floors."
    )


@pytest.mark.parametrize(
    ("other", "ending"),
    [
        ({}, "falls from 3.1 to 1.3 floors on the check dive."),
        ({"check": None}, "falls from 3.4 to 1.2 floors on pieces held out."),
        ({"check": Shrink(3.0, 3.5, -0.25, NAN, NAN)}, "goes from 3.0 to 3.5 floors on the check dive."),
    ],
)
def test_the_verdict_speaks_of_the_best_evidence_there_is(other: dict[str, object], ending: str):
    assert verdict_words.verdict_sentence(diagnosis(**other)).endswith(ending)


def test_a_check_dive_that_does_not_bear_the_cause_out_is_told_in_the_headline():
    told = diagnosis(heldout=Shrink(3.0, 1.0, 0.98, 0.95, 1.0), check=Shrink(3.0, 2.8, 0.11, 0.0, 0.2))
    but = "but the check dive does not bear that out (98 % of what can be closed was foretold to close there, and "
    assert but in verdict_words.verdict_sentence(told)
    assert but in verdict_words.verdict_sentence(replace(told, verdict="unknown"))


def test_two_causes_are_named_as_two():
    said = verdict_words.verdict_sentence(
        diagnosis(found=(found("quadratic_drag"), found("weak_thruster", 3)))
    )
    assert said.startswith("Quadratic drag and weak thruster 3 explain the gap: ")


def test_causes_that_can_not_be_told_apart_are_named_together():
    lag = found("thruster_lag", also=("command_delay",), likeness={"command_delay": 0.97})
    said = diagnosis(verdict="ambiguous", found=(lag,))
    assert verdict_words.verdict_sentence(said).startswith(
        "Thruster lag or command delay explains the gap, but this dive can't tell thruster lag from command delay: "
    )
    (line,) = words.cause_lines(said)
    told = (
        "This dive can't tell it from command delay (likeness 0.97); what would: shaft speeds, and fast steps in a "
        "log of 50 Hz."
    )
    assert line.endswith(told)
    assert f"{told}\nLikeness: at 1 no method could tell" in read(said)


def test_a_dive_without_a_gap_is_told_so_and_names_no_cause():
    quiet = diagnosis(verdict="no_gap", gap=gap(1.02, 1.02), found=(), heldout=NOTHING, check=None)
    assert verdict_words.verdict_sentence(quiet) == (
        "No gap: the model's 5 s drift is 1.0 floors, where noise alone would give 1 (0.8 to 1.2 by chance), and no "
        "candidate explains any of it."
    )
    assert words.cause_lines(quiet) == ()
    assert verdict_words.shrink_lines(quiet) == (
        "On pieces held out: the 5 s drift goes from 1.0 floors to 1.0 floors; there is too little gap to shrink.",
    )
    assert "No candidate of the library explains anything that noise would not." in read(quiet)


def test_a_drift_beyond_chance_that_nothing_explains_is_never_called_no_gap():
    drifting = diagnosis(verdict="no_gap", gap=gap(3.0, 3.0), found=(), heldout=NOTHING, check=None)
    assert verdict_words.verdict_sentence(drifting) == (
        "Nothing that lasts: the model's 5 s drift is 3.0 floors, where noise alone would give 1 (0.8 to 1.2 by "
        "chance), but neither a candidate nor any force that returns explains it."
    )
    page = read(drifting)
    assert "There is no gap" not in page
    assert "fly the same again to see whether it lasts" in page


def test_where_there_is_no_gap_the_page_shows_no_shares_of_it_and_no_empty_picture():
    weak = (Tried("waves", "waves", 1.9, False), Tried("dvl_bias", "dvl_bias", 0.0, False))
    quiet = diagnosis(verdict="no_gap", gap=gap(1.02, 1.02), found=(), tried=weak, check=None)
    page = read(quiet)
    assert "There is no gap, so it lies nowhere" in page
    assert "What the missing force goes with" not in page
    assert "Missing" not in page
    assert "surge\n1.0\n1.0\n1.0" in page
    assert "Here none of 2 candidates saves more than 2 nats." in page
    names = {figure.name for part in diagnosis_report(quiet).sections for figure in part.figures}
    assert names == {"drift over the dive", "drift by horizon"}
    assert "There is no gap, so it lies nowhere" not in read(diagnosis())


def test_a_table_of_many_columns_breaks_its_headings_before_it_leaves_the_page():
    assert ".scroll thead th { white-space: normal; }" in diagnosis_page(diagnosis())


def test_what_no_candidate_explains_is_described():
    said = diagnosis(verdict="unknown", character=UNKNOWN)
    assert verdict_words.verdict_sentence(said) == (
        "Something is there that no candidate explains: 71 % of it is in surge, steady, mostly above 0.30 m/s; it is "
        "fixed to the world, even in speed, intermittent, and goes with heading and yaw rate. Quadratic drag explains "
        "part of the gap."
    )
    page = read(said)
    assert "What no candidate explains: It acts in yaw. It is fixed to the world." in page
    assert "It goes with heading and yaw rate." in page


def test_a_cause_less_probable_than_not_is_told_as_possible():
    bias = found("thrust_bias", probability=0.42)
    beside = verdict_words.verdict_sentence(diagnosis(found=(found("quadratic_drag"), bias)))
    assert beside.startswith(
        "Quadratic drag explains the gap; thrust bias (42 % probable) may explain some of it, too: 71 % of it "
    )
    alone = verdict_words.verdict_sentence(diagnosis(found=(bias,)))
    assert alone.startswith("Thrust bias (42 % probable) may explain the gap: ")
    unknown = verdict_words.verdict_sentence(diagnosis(verdict="unknown", found=(bias,)))
    assert unknown.endswith("Thrust bias (42 % probable) may explain part of the gap.")


def test_what_is_recorded_and_not_the_motion_is_never_said_to_make_the_drift_fall():
    heard = Found(Cause(WRONG_FEEDBACK_LOG, np.zeros(0)), (), {}, 0.9, {}, 0.0)
    said = verdict_words.verdict_sentence(
        diagnosis(found=(heard,), heldout=Shrink(0.99, 0.99, NAN, NAN, NAN), check=None)
    )
    assert said.endswith(
        "it shows in what is recorded, not in the motion: with it or without, the model's 5 s drift is 0.99 floors on "
        "pieces held out, where noise alone would give 1 (0.8 to 1.2 by chance)."
    )


def test_a_cause_that_makes_no_drift_is_said_to_open_no_gap():
    lag = replace(found("thruster_lag"), probability=0.89)
    small = replace(gap(), before=1.02)
    said = verdict_words.verdict_sentence(
        diagnosis(found=(lag,), gap=small, heldout=Shrink(0.96, 0.96, NAN, NAN, NAN), check=None)
    )
    assert said.startswith("Thruster lag shows, but opens no gap: ")
    assert "% of what shows is in " in said
    chance = verdict_words.verdict_sentence(
        diagnosis(found=(lag,), gap=small, heldout=Shrink(0.98, 0.91, NAN, NAN, NAN), check=None)
    )
    assert chance.startswith("Thruster lag shows, but opens no gap: ")
    assert chance.endswith(
        "; without it the model's 5 s drift is 0.98 floors, with it 0.91 floors on pieces held out, where noise alone "
        "would give 1 (0.8 to 1.2 by chance)."
    )
    closes = diagnosis(found=(lag,), gap=small, heldout=Shrink(1.15, 1.0, 0.9, NAN, NAN), check=None)
    assert verdict_words.verdict_sentence(closes).startswith("Thruster lag explains the gap: ")
    wide = verdict_words.verdict_sentence(
        diagnosis(found=(lag,), heldout=Shrink(0.96, 0.96, NAN, NAN, NAN), check=None)
    )
    assert wide.startswith("Thruster lag explains the gap: ")


def test_what_nothing_can_be_relied_on_for_comes_before_the_cause():
    first = mounted_otherwise((0,), ())
    said = verdict_words.verdict_sentence(diagnosis(first=first, provisos=("Heave was not judged.",)))
    assert said.startswith(
        "The recorded motion does not go the way the thrust pushes, and no cause can be relied on until that is "
        "mended. In surge the recorded velocity runs against the thrust: "
    )
    assert said.index("Quadratic drag explains") > said.index("check both")
    assert said.endswith(" Heave was not judged.")
    assert mounted_otherwise((), ()) == ()


def test_a_cause_that_no_nats_speak_for_is_said_to_rest_on_another_test():
    heard = Found(Cause(WRONG_FEEDBACK_LOG, np.zeros(0)), (), {}, 0.9, {}, 0.0)
    assert "rests on another test" in read(diagnosis(found=(heard,)))
    assert "rests on another test" not in read(diagnosis())


def test_no_speed_is_named_below_which_a_vehicle_counts_as_at_rest():
    def above(low: float) -> str:
        slices = (Slice("surge", "speed", 0.0, low, 0.01), Slice("surge", "speed", low, 0.6, 0.82))
        return where_words.where_sentence(replace(gap(), slices=slices))

    assert above(0.057).endswith("in surge, steady, mostly above 0.06 m/s")
    assert above(0.0041).endswith("in surge, steady")


def test_the_drift_of_the_whole_dive_stands_beside_those_that_the_verdict_tells_of():
    assert verdict_words.shrink_lines(diagnosis(check=None))[0] == (
        "Over the whole dive, which was fitted: the 5 s drift goes from 3.4 floors to 0.85 floors."
    )
    page = read(diagnosis())
    assert "fitted: the whole dive\n3.40\n0.849" in page
    assert "a dive without any gap comes to 0.8 to 1.2" in page


def test_of_what_no_candidate_explains_it_is_told_where_that_lies_and_not_where_the_whole_gap_does():
    left = replace(gap(), unexplained=(Share("yaw", "turning", 1.0),))
    said = verdict_words.verdict_sentence(diagnosis(verdict="unknown", character=UNKNOWN, gap=left))
    assert said.startswith("Something is there that no candidate explains: 100 % of it is in yaw, turning; ")


def test_a_gap_that_is_spread_is_told_by_its_degree_of_freedom():
    spread = tuple(
        Share(dof, phase, share)
        for dof, phase, share in (
            ("surge", "steady", 0.35),
            ("surge", "turning", 0.25),
            ("sway", "steady", 0.4 - 1e-9),
        )
    )
    where = where_words.where_sentence(replace(gap(), where=spread, slices=()))
    assert where == "60 % of it is in surge, most of that steady"


def test_a_degree_of_freedom_that_drifts_most_without_the_most_force_is_named():
    assert where_words.where_note(gap()) == ""
    sway = replace(gap(), where=(Share("sway", "steady", 0.8), Share("surge", "steady", 0.2)))
    drifted = (Share("surge", "turning", 0.6), Share("sway", "steady", 0.3), Share("surge", "rest", 0.1))
    sway = replace(sway, drifted=drifted)
    assert where_words.where_note(sway).startswith(
        "By drift it is another: 70 % of what the squared 5 s drift is beyond noise, in floors, is in surge."
    )
    assert verdict_words.verdict_sentence(diagnosis(gap=sway, check=None)).startswith(
        "Quadratic drag explains the gap: by drift 60 % of it is in surge, turning (by force 80 % of it is in sway, "
        "steady); with it the model's"
    )
    assert "by drift" not in verdict_words.verdict_sentence(diagnosis(gap=replace(sway, drifted=sway.where)))
    assert "What is shared out is force, not drift" in read(diagnosis())
    assert "By drift it is another" in read(diagnosis(gap=sway))
    assert where_words.where_note(replace(sway, before=1.1)) == ""


def test_most_is_not_said_of_what_is_no_more_than_half():
    shares = (
        ("surge", "steady", 0.19),
        ("surge", "turning", 0.15),
        ("surge", "rest", 0.06),
        ("yaw", "steady", 0.3),
    )
    rest = Share("sway", "steady", 0.3)
    spread = (*(Share(dof, phase, share) for dof, phase, share in shares), rest)
    where = where_words.where_sentence(replace(gap(), where=spread, slices=()))
    assert where == "40 % of it is in surge, the largest part of that steady"


def test_speed_is_not_named_where_the_gap_does_not_go_with_it():
    even = tuple(Slice("surge", "speed", 0.2 * k, 0.2 * (k + 1), 0.3) for k in range(3))
    assert where_words.where_sentence(replace(gap(), slices=even)).endswith("in surge, steady")


def test_the_largest_parts_come_first_and_nothing_is_named_that_rounds_to_none():
    assert where_words.where_lines(diagnosis()) == (
        "71 % surge, steady",
        "15 % sway, turning",
        "12 % surge, accelerating",
    )
    tiny = replace(gap(), where=(Share("surge", "rest", 0.998), Share("yaw", "rest", 0.002)))
    assert where_words.where_lines(diagnosis(gap=tiny)) == ("100 % surge, at rest",)


def test_parameters_have_units_and_intervals_that_a_crew_reads():
    assert (
        words.value_words("X_uu", Value(12.34, "N s2/m2", 10.1, 14.5))
        == "X_uu 12.3 N s²/m² (95 %: 10.1 to 14.5)"
    )
    assert words.value_words("yaw", Value(0.0349, "rad", NAN, NAN)) == "yaw 0.03490 rad, 2.0°"
    assert words.value_words("rate", Value(2e-4, "1/s", NAN, NAN)).endswith("1/s, 1.2 % a minute")
    assert (
        words.value_words("low_end_loss", Value(0.2, "1", 0.1, 0.3))
        == "low end loss 0.20 (95 %: 0.10 to 0.30)"
    )


def test_no_cause_is_ever_told_as_certain():
    assert words.percent_sure(1.0) == "over 99 %"
    assert words.percent_sure(0.0) == "under 1 %"
    assert words.percent_sure(0.87) == "87 %"


def test_the_page_stands_alone_and_runs_nothing():
    page = Text(diagnosis_page(diagnosis()))
    tags = {tag for tag, _ in page.attributes}
    assert not {"script", "link", "img", "iframe", "object", "form"} & tags
    assert not [
        a
        for _, a in page.attributes
        for key, value in a.items()
        if "http" in (value or "") and key != "xmlns"
    ]


def test_the_parts_come_in_the_order_in_which_a_crew_asks():
    html = diagnosis_page(diagnosis(next=Next("a coast-down", "", ("quadratic_drag", "inflow_loss"))))
    assert re.findall(r"<h2>(.*?)</h2>", html) == [
        "1. Where it lies",
        "1.1 How large it is",
        "1.2 What it goes with",
        "2. What causes it",
        "2.1 All candidates",
        "3. How far it shrinks",
        "What to dive next",
        "Notes",
    ]
    assert html.index("explains the gap") < html.index("<h2>")


def drawn(panel: Panel) -> Axes:
    (box,) = stack([panel])(WIDE_IN).axes
    return box


def test_the_map_shows_each_share_and_its_sums_and_shades_the_largest():
    box = drawn(heatmap(("at rest", "steady"), ("surge", "yaw"), np.array([[0.0, 0.1], [0.7, 0.2]])))
    told = {(int(text.get_position()[1]), int(text.get_position()[0])): text.get_text() for text in box.texts}
    assert told == {
        (0, 1): "10",
        (0, 2): "10",
        (1, 0): "70",
        (1, 1): "20",
        (1, 2): "90",
        (2, 0): "70",
        (2, 1): "30",
        (2, 2): "100",
    }
    assert np.asarray(box.collections[0].get_array()).ravel().tolist() == [0, 1, 5, 2]
    assert [label.get_text() for label in box.get_yticklabels()] == ["at rest", "steady", "all"]


def test_a_map_of_nothing_is_a_map():
    assert not drawn(heatmap(("steady",), ("surge",), np.zeros((1, 1)))).texts


def test_bars_are_no_longer_than_their_room_and_never_negative():
    box = drawn(bars((Bar("a", 1.3, "7 N", "accepted"), Bar("b", -0.2, "−1 N"), Bar("<c>", 0.5, "1 N"))))
    assert [bar.get_width() for bar in box.patches] == [1.0, 0.0, 0.5]
    filled, hollow, _ = (bar.get_facecolor() for bar in box.patches)
    assert filled != hollow
    assert [text.get_text() for text in box.texts] == ["a: accepted", "7 N", "b", "−1 N", "<c>", "1 N"]


@pytest.mark.parametrize("width_in", [WIDE_IN, COLUMN_IN])
@pytest.mark.parametrize(
    "name", ["0.30 to 0.60 m/s", "waves (2.25 and 2.33 s) (too little here: 30 nats are asked for)"]
)
def test_names_of_bars_stand_clear_of_the_bars_and_their_numbers(width_in: float, name: str):
    picture = stack(
        [bars([Bar(name, 1.0, "1000 nats")] * 3 + [Bar("a", 1.0, "1", "accepted")] * ("waves" in name))]
    )(width_in)
    picture.draw_without_rendering()
    (box,) = picture.axes
    places = [text.get_window_extent() for text in box.texts]
    assert not [(a, b) for i, a in enumerate(places) for b in places[:i] if a.overlaps(b)]


def test_every_candidate_stands_once_in_its_best_form_and_the_accepted_one_is_marked():
    page = Text(diagnosis_page(diagnosis()))
    names = [line for line in page.lines if line.startswith(("munk moment", "quadratic drag"))]
    assert sum(line.startswith("munk moment (") for line in names) == 1
    assert [line for line in page.lines if line.endswith(": accepted")] == ["quadratic drag: accepted"]
    assert page.lines[page.lines.index("quadratic drag: accepted") + 1] == "61 nats"
    (figure,) = [
        f for part in diagnosis_report(diagnosis()).sections for f in part.figures if f.name == "candidates"
    ]
    widths = [bar.get_width() for bar in figure.draw(WIDE_IN).axes[0].patches]
    assert widths[:2] == pytest.approx([1.0, math.log1p(4.8) / math.log1p(61.2)])
    named = {(one.name, one.number): one.label for one in LIBRARY}
    told = {key for key in named if any(5.0 - 0.2 * k > 2.0 for k in places(key))} | {("quadratic_drag", 0)}
    shown = sum("nats" in line and line[0].isdigit() and "others" not in line for line in page.lines)
    assert shown == len(told)
    (caption,) = [line for line in page.lines if line.startswith("What each candidate saves")]
    assert caption.endswith(f" {len(named) - len(told)} others: none gains more than 2 nats.")
    assert any("2.7 times as likely" in line for line in page.lines)


def test_a_candidate_that_is_less_probable_than_not_is_possible_and_not_accepted():
    drag = replace(found("quadratic_drag"), probability=0.42)
    page = Text(diagnosis_page(diagnosis(found=(drag,))))
    assert page.lines[page.lines.index("quadratic drag (possible: 42 % probable)") + 1] == "61 nats"
    assert not [line for line in page.lines if line.endswith(": accepted")]
    half = replace(drag, probability=0.5)
    assert "quadratic drag: accepted" in Text(diagnosis_page(diagnosis(found=(half,)))).lines


def places(key: tuple[str, int]) -> list[int]:
    """Where the forms of one candidate stand in the library."""
    return [k for k, one in enumerate(LIBRARY) if (one.name, one.number) == key]


def test_a_candidate_that_would_save_enough_and_was_not_accepted_says_why():
    why = Tried("waves", "waves (2.25 and 2.33 s)", 20.0, False, "too little here: 30 nats are asked for")
    page = read(diagnosis(tried=(*diagnosis().tried, why)))
    assert "waves (2.25 and 2.33 s) (too little here: 30 nats are asked for)\n20 nats" in page


def test_one_thruster_is_named_once_with_its_number():
    assert words.label_words("weak_thruster", "weak_thruster of thruster 8") == "weak thruster 8"
    turned = effect("thruster_misalignment", 2)
    assert words.label_words(turned.name, turned.label).startswith("thruster misalignment (thruster 2)")
    assert words.effect_words(effect("weak_thruster", 8)) == "weak thruster 8"


def test_an_interval_of_nothing_but_one_number_is_left_out():
    assert words.percents(0.84, 0.94) == "84 % to 94 %"
    assert words.percents(-0.001, 0.004) == words.percents(NAN, 0.4) == ""
    none = Shrink(1.5, 1.5, 0.0, 0.0, 0.0)
    assert verdict_words.shrink_lines(diagnosis(check=None, heldout=none))[1:] == (
        "On pieces held out: the 5 s drift goes from 1.5 floors to 1.5 floors, 0 % of what can be closed.",
    )
    assert "1.50\n1.50\n0 %\n—" in read(diagnosis(heldout=none))


def test_a_depth_that_stays_the_same_is_not_sliced():
    still = replace(
        gap(), slices=tuple(Slice("surge", "depth", 0.6 + 1e-4 * k, 0.6001 + 1e-4 * k, 0.3) for k in range(3))
    )
    assert "0.60 to 0.60" not in read(diagnosis(gap=still))


def test_slices_are_in_the_units_of_what_they_slice_by():
    page = read(diagnosis())
    for told in ("0.30 to 0.60 m/s", "0° to 180°", "2.0 to 5.0 m", "5.0 to 7.5 m"):
        assert told in page


def test_a_slice_that_is_the_whole_says_nothing_and_is_not_shown():
    assert "voltage\n" not in read(diagnosis())


def test_the_drift_stands_before_and_after_by_degree_of_freedom():
    page = read(diagnosis())
    assert "surge\n83 %\n2.4 N\n3.4 → 1.2\n3.4 → 1.2\n3.4 → 1.2" in page
    assert "yaw\n2 %\n0.12 N m\n1.7 → 0.6" in page


def test_predicted_and_measured_shrink_stand_side_by_side():
    page = read(diagnosis())
    assert "predicted: pieces held out\n3.40\n1.25\n90 %\n84 % to 94 %" in page
    assert "measured: the check dive\n3.10\n1.30\n86 %\n79 % to 92 %" in page
    assert "What was predicted and what was measured are 4 points apart." in page
    near = diagnosis(heldout=Shrink(3.0, 1.0, 0.99, NAN, NAN), check=Shrink(3.0, 1.0, 0.98, NAN, NAN))
    assert "are 1 point apart." in read(near)


def test_the_feed_forward_s_gain_is_told_in_millimetres_a_second_and_where_there_is_none_why():
    gained = diagnosis(found=(found("quadratic_drag", feedforward=Gain(0.0234, 0.0051)), found("dvl_bias")))
    page = read(gained)
    assert "quadratic drag\n23 mm/s\n5.1 mm/s\nquadratic drag" in page
    assert "DVL bias\n—\n—\nnothing: the feed-forward can't" in page
    assert words.gain_lines(gained) == (
        "Quadratic drag: the feed-forward alone would track to 5.1 mm/s instead of 23 mm/s (typical velocity error).",
    )


def test_what_to_dive_next_says_what_it_splits():
    said = diagnosis(next=Next("a coast-down", "shaft speeds", ("thruster_lag", "command_delay")))
    assert words.next_lines(said) == (
        "Dive next: a coast-down. It splits thruster lag and command delay.",
        "Record as well: shaft speeds.",
    )
    assert "Record as well: shaft speeds." in read(said)


def test_a_diagnosis_of_nothing_at_all_is_still_a_page():
    empty = Gap(NAN, (), (), {}, (), (), ())
    bare = diagnosis(
        verdict="no_gap", gap=empty, found=(), tried=(), heldout=None, check=None, next=None, notes=()
    )
    page = read(bare)
    assert "No degree of freedom could be compared with the model." in page
    assert "nan" not in page
