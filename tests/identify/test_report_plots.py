"""Plots of a report: extremes and gaps stay, the path is whole."""

import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from identify.dive import Dive, Signal
from identify.report.figures import broken_at_gaps, track
from identify.report.page import Report, Section, Table, render_report
from identify.report.picture import inline, write_files
from identify.report.plot import DARK, LIGHT, STYLES, Line, lines_panel, stack
from identify.words import count, fixed, seconds, significant, unit, with_interval

RISING = Line(np.array([0.0, 1.0]), np.array([0.0, 1.0]), "measured")


def of(*lines, title="y, m"):
    return stack([lines_panel(title, "x, s", lines)])


def wide(draw):
    """The form of the page on a wide screen."""
    return inline(draw, "label", "k").partition('<svg class="column-picture"')[0]


def strokes(path):
    """Each stroke of a path that begins somewhere and goes on by steps, as points (n, 2), y downwards."""
    numbers = (re.findall(r"-?(?:\d+\.?\d*|\.\d+)", stroke) for stroke in filter(None, path.split("M")))
    return [np.cumsum(np.array(steps, dtype=float).reshape(-1, 2), axis=0) for steps in numbers]


def curves(svg, style=0):
    """The strokes of the lines in a style, as points of the page, y downwards."""
    name = next(name for name, colour in LIGHT.items() if colour == STYLES[style]["color"])
    lines = []
    for path, how in re.findall(r'<path d="([^"]*)"[^>]*style="([^"]*)"', svg):
        if f"stroke: var(--{name})" in how and "fill: none" in how:
            lines += strokes(path)
    return lines


def test_a_lone_spike_of_a_million_samples_is_drawn():
    y = np.zeros(1_000_000)
    y[654_321] = 1.0
    (stroke,) = curves(wide(of(Line(np.arange(1e6), y))))
    assert len(stroke) < 12
    left, right = stroke[:, 0].min(), stroke[:, 0].max()
    top = stroke[stroke[:, 1].argmin()]
    assert np.ptp(stroke[:, 1]) > 50
    assert (top[0] - left) / (right - left) == pytest.approx(0.654, abs=0.002)


def test_steps_of_a_tenth_of_a_point_do_not_add_up_to_an_error():
    y = np.sin(np.arange(5000) / 7.7)
    (stroke,) = curves(wide(of(Line(np.arange(5000.0), y))))
    assert len(stroke) > 500
    across = (stroke[:, 0] - stroke[0, 0]) / (stroke[-1, 0] - stroke[0, 0]) * 4999
    high = (stroke[:, 1].max() - stroke[:, 1]) / np.ptp(stroke[:, 1]) * np.ptp(y) + y.min()
    assert np.abs(high - np.sin(across / 7.7)).max() < 0.1


def test_a_long_noisy_line_stays_small():
    noise = np.random.default_rng(0).normal(size=200_000)
    assert len(inline(of(Line(np.arange(2e5), noise)), "noise", "k")) < 45_000


def test_a_silence_breaks_the_line():
    signal = Signal(np.array([0.0, 0.1, 0.2, 5.0, 5.1]), np.arange(5.0)[:, None])
    time_s, value = broken_at_gaps(signal, 0, 1.0)
    assert time_s.tolist() == [0.0, 0.1, 0.2, 0.2, 5.0, 5.1]
    assert np.array_equal(value, [0, 1, 2, np.nan, 3, 4], equal_nan=True)


def test_the_page_colours_a_figure_by_the_reader_s_scheme_and_lines_differ_without_colour():
    lines = [Line(RISING.x, RISING.y + style, word, style) for style, word in enumerate("abcd")]
    svg = inline(of(*lines), "label", "k")
    assert len(set(re.findall(r"stroke-dasharray: ([\d., ]+)", svg))) >= 3
    assert "var(--first)" in svg
    assert not re.findall(r"#[0-9a-f]{6}", svg)
    assert len(set(LIGHT.values())) == len(LIGHT)
    assert LIGHT.keys() == DARK.keys()


@pytest.mark.parametrize("colours", [LIGHT, DARK])
def test_lines_stand_out_from_their_ground_in_both_schemes(colours):
    def luminance(colour):
        share = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
        linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
        return float(linear @ [0.2126, 0.7152, 0.0722])

    for name in ("first", "second", "third", "fourth", "ink", "soft"):
        darker, lighter = sorted((luminance(colours[name]), luminance(colours["ground"])))
        assert (lighter + 0.05) / (darker + 0.05) > 4.9


def test_both_forms_of_a_figure_say_the_same_and_share_no_id():
    svg = inline(stack([lines_panel("speed, m/s", "time, s", [RISING])]), "speeds", "part-1-2")
    both = svg.partition('<svg class="column-picture"')
    for form in (both[0], both[2]):
        assert {"speed, m/s", "time, s", "measured"} <= set(re.findall(r">([^<>]+)</text>", form))
        assert set(re.findall(r'(?:url\(|href=")#([^)"]+)', form)) == set(re.findall(r' id="([^"]+)"', form))
    ids = re.findall(r' id="([^"]+)"', svg)
    assert len(ids) == len(set(ids))
    assert all(name.startswith("part-1-2") for name in ids)
    assert svg.count('role="img" aria-label="speeds"') == 2


def test_words_in_a_plot_are_text_and_never_markup_or_mathematics():
    svg = inline(of(Line(RISING.x, RISING.y, "<s>$x^2$"), title="<b>\x1b\u202e潜水"), "l", "k")
    assert not re.search(r"<[bs]>", svg)
    assert "&lt;s&gt;$x^2$</text>" in svg
    assert "&lt;b&gt;\ufffd\ufffd潜水</text>" in svg


def test_the_same_figure_is_the_same_bytes(tmp_path):
    for name in ("a", "b"):
        write_files(of(RISING), tmp_path / name)
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert inline(of(RISING), "l", "k") == inline(of(RISING), "l", "k")


def test_files_for_a_paper_are_a_column_wide_on_white_with_their_words_as_text(tmp_path):
    svg, png = write_files(of(RISING), tmp_path / "of.dots")
    assert (svg.name, png.name) == ("of.dots.svg", "of.dots.png")
    with Image.open(png) as image:
        assert image.size[0] == round(3.46 * 300)
        assert image.convert("RGB").getpixel((0, 0)) == (255, 255, 255)
    assert ">y, m</text>" in svg.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("value", "low", "high", "expected"),
    [
        (111.9123, 110.54, 113.28, ("111.9", "110.5 to 113.3")),
        (24.4, 24.3871, 24.4129, ("24.400", "24.387 to 24.413")),
        (12345.0, 11000.0, 13690.0, ("12300", "11000 to 13700")),
        (-0.02, -0.5, 0.46, ("−0.02", "−0.50 to 0.46")),
        (5.0, float("nan"), float("nan"), ("5.000", "—")),
        (float("nan"), float("nan"), float("nan"), ("—", "—")),
    ],
)
def test_a_value_has_the_digits_that_its_interval_allows(value, low, high, expected):
    assert with_interval(value, low, high) == expected


def test_numbers_read_well():
    assert [significant(v) for v in (0.0, 0.0021149, 1234.0, -3.0, 99.95, float("inf"))] == [
        "0",
        "0.00211",
        "1230",
        "−3.00",
        "100",
        "—",
    ]
    assert fixed(-0.0001, 2) == "0.00"
    assert count(10442) == "10\u00a0442"
    assert [seconds(s) for s in (0.04, 41.23, 417.65, 7260.0)] == [
        "0.040 s",
        "41.2 s",
        "6 min 58 s",
        "2 h 1 min",
    ]
    assert [unit(u) for u in ("kg", "kg m2", "kg/m3", "N m/(rad/s)")] == [
        "kg",
        "kg m²",
        "kg/m³",
        "N m/(rad/s)",
    ]


def test_a_unit_in_a_sentence_or_in_words_of_a_table_is_written_as_in_its_column():
    """Sentences come as a terminal shows them; names of dives, files and coefficients stay as they are."""
    said = "N_rdot is I_r less the rigid body's 14 kg m2, at 1025 kg/m3, of run 3 m2 and X_uu 2.1 N s2/m2."
    raised = "N_rdot is I_r less the rigid body's 14 kg m², at 1025 kg/m³, of run 3 m2 and X_uu 2.1 N s²/m²."
    table = Table(("Name", "Meaning"), (("I_r", said),))
    assert table.shown == (("I_r", raised),)
    html = render_report(Report("t", "", said, (Section("s", said, (table,)),)))
    for place in ('class="verdict">', "</h2>\n<p>", 'data-label="Meaning">'):
        shown = html.partition(place)[2].partition("</")[0].replace("\N{NO-BREAK SPACE}", " ")
        assert shown == raised.replace("'", "&#x27;")


def circling(samples):
    """Two rounds of a circle, at 10 Hz."""
    time_s = np.arange(samples) / 10.0
    heading = 4 * np.pi * np.arange(samples) / samples
    attitude = np.column_stack((np.cos(heading / 2), np.zeros((samples, 2)), np.sin(heading / 2)))
    velocity = np.tile([0.4, 0.0, 0.0], (samples, 1))
    return Dive(
        "circle", Path("c.tlog"), "", velocity=Signal(time_s, velocity), attitude=Signal(time_s, attitude)
    )


@pytest.mark.parametrize("samples", [500, 9729])
def test_a_circle_is_drawn_whole_and_round_with_a_single_label_for_start_and_end(samples):
    drawn, part = track(circling(samples)), track(circling(2400).between(0.0, 60.0))
    assert drawn.draw(10.0).axes[0].get_legend_handles_labels()[1] == ["start and end"]
    assert part.draw(10.0).axes[0].get_legend_handles_labels()[1] == ["start", "end"]
    svg = inline(drawn.draw, "path", "k").partition('<svg class="column-picture"')[0]
    path = max(re.findall(r'<path d="([^"]*)"', svg), key=len)
    (points,) = strokes(path)
    wide, high = np.ptp(points, axis=0)
    assert wide == pytest.approx(high, rel=0.01)
    around = np.hypot(*np.diff(points, axis=0).T).sum()
    assert around == pytest.approx(2 * np.pi * wide, rel=0.02)
